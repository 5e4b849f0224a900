#pragma once
// Noise computed once on a small periodic grid and read back by trilinear interpolation: the price
// of a fetch does not depend on what was computed. Four channels of 16 bits, 2 MB.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/types.h"
#include "scenes/lanes.h"

namespace rugae {

class NoiseTile {
 public:
  static constexpr int kVoxels = 64;  // along an edge
  static constexpr int kCells = 8;    // lattice cells along an edge: a period of eight features
  using Channels = std::array<float, 4>;

  /// Fills the tile: `value` is asked at positions in lattice cells, 0 to kCells, and must repeat
  /// after kCells. Channel c is stored in [-range[c], range[c]].
  NoiseTile(const std::function<Channels(const Vec3&)>& value, const Channels& range);

  /// Where a position lies in the tile: the rows of voxels around it, and its shares of them.
  struct Place {
    const std::int16_t *near, *near_up, *far, *far_up;
    __m128i wx;
    Lanes fy, fz;
  };
  /// `cells` is a position in lattice cells (within 1e5 cells of 0; the fourth lane is not used).
  Place locate(Lanes cells) const {
    constexpr float kScale = static_cast<float>(kVoxels) / kCells;
    const Lanes p = cells * splat(kScale);
    // floor and fraction; truncation rounds negative numbers up, so those step down by one
    __m128i whole = _mm_cvttps_epi32(p);
    Lanes fraction = p - _mm_cvtepi32_ps(whole);
    const Lanes below = _mm_cmplt_ps(fraction, _mm_setzero_ps());
    whole = _mm_add_epi32(whole, _mm_castps_si128(below));
    fraction = fraction + _mm_and_ps(below, splat(1.0f));
    alignas(16) std::int32_t i[4];
    _mm_store_si128(reinterpret_cast<__m128i*>(i),
                    _mm_and_si128(whole, _mm_set1_epi32(kVoxels - 1)));

    const int fx = _mm_cvttss_si32(_mm_mul_ss(fraction, _mm_set_ss(kWeights)));
    constexpr int kNextY = 4 * kRow, kNextZ = kNextY * kVoxels, kMask = kVoxels - 1;
    const std::int16_t* near = voxels_.data() + 4 * i[0] + kNextY * i[1] + kNextZ * i[2];
    const std::int16_t* far = near + (i[2] == kMask ? -kMask * kNextZ : kNextZ);
    const int up = i[1] == kMask ? -kMask * kNextY : kNextY;
    return {near,
            near + up,
            far,
            far + up,
            _mm_set1_epi32(fx << 16 | (kWeights - fx)),
            _mm_shuffle_ps(fraction, fraction, _MM_SHUFFLE(1, 1, 1, 1)),
            _mm_shuffle_ps(fraction, fraction, _MM_SHUFFLE(2, 2, 2, 2))};
  }
  /// Asks for the memory of a place that will be fetched soon: the tile is larger than the nearest
  /// caches, and fine layers jump about in it.
  static void prefetch(const Place& place) {
    for (const std::int16_t* row : {place.near, place.near_up, place.far, place.far_up})
      _mm_prefetch(reinterpret_cast<const char*>(row), _MM_HINT_T0);
  }
  /// The four channels. Across x in 15-bit integers, across y and z in single precision.
  Lanes fetch(const Place& place) const {
    const Lanes near = mix(row(place.near, place.wx), row(place.near_up, place.wx), place.fy);
    const Lanes far = mix(row(place.far, place.wx), row(place.far_up, place.wx), place.fy);
    return mix(near, far, place.fz) * _mm_loadu_ps(step_.data());
  }
  Lanes fetch(Lanes cells) const { return fetch(locate(cells)); }

 private:
  static constexpr int kRow = kVoxels + 1;  // the first voxel again at the end: no wrap in x
  static constexpr int kWeights = 32767;

  static Lanes mix(Lanes a, Lanes b, Lanes t) { return a + t * (b - a); }
  // Both voxels of a row in one load; each channel's pair is weighted and added in one step.
  static Lanes row(const std::int16_t* first, __m128i weights) {
    const __m128i both = _mm_loadu_si128(reinterpret_cast<const __m128i*>(first));
    const __m128i pairs = _mm_unpacklo_epi16(both, _mm_srli_si128(both, 8));
    return _mm_cvtepi32_ps(_mm_madd_epi16(pairs, weights));
  }

  std::vector<std::int16_t> voxels_;
  Channels step_;  // of one count
};

}  // namespace rugae
