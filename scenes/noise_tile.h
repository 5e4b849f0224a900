#pragma once
// Noise computed once on a small periodic grid and read back by trilinear interpolation: the price
// of a fetch does not depend on what was computed. Four channels of 16 bits, 2 MB.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/float4.h"
#include "core/types.h"

namespace rugae {

class NoiseTile {
 public:
  static constexpr int kVoxels = 64;  // along an edge
  static constexpr int kCells = 8;    // lattice cells along an edge: a period of eight features
  using Channels = std::array<float, 4>;

  /// Fills the tile: `value` is asked at positions in lattice cells, 0 to kCells, and must repeat
  /// after kCells. Channel c is stored in [-range[c], range[c]].
  NoiseTile(const std::function<Channels(const Vec3&)>& value, const Channels& range);

  /// Where four positions lie in the tile: the first of the eight voxels around each, as an index,
  /// and their shares of them.
  struct Places {
    alignas(16) std::array<std::int32_t, 4> first;
    __m128i wx;  // of a row's two voxels, 15 bits each
    Float4 fy, fz;
  };
  /// `cells` are positions in lattice cells, within 1e5 cells of 0.
  Places locate(const Float4x3& cells) const {
    const Float4 scale = splat(static_cast<float>(kVoxels) / kCells);
    const Floor x = floor_of(cells.x * scale), y = floor_of(cells.y * scale),
                z = floor_of(cells.z * scale);
    const __m128i wrap = _mm_set1_epi32(kVoxels - 1);
    const auto wrapped = [wrap](const Floor& v) { return _mm_and_si128(v.whole, wrap); };
    const __m128i rows = _mm_or_si128(wrapped(y), _mm_slli_epi32(wrapped(z), 16));
    Places places;
    _mm_store_si128(reinterpret_cast<__m128i*>(places.first.data()),
                    _mm_add_epi32(_mm_madd_epi16(rows, _mm_set1_epi32(kNextZ << 16 | kNextY)),
                                  _mm_slli_epi32(wrapped(x), 2)));
    const __m128i fx = _mm_cvttps_epi32(x.part * splat(kWeights));
    places.wx = _mm_or_si128(_mm_slli_epi32(fx, 16), _mm_sub_epi32(_mm_set1_epi32(kWeights), fx));
    places.fy = y.part;
    places.fz = z.part;
    return places;
  }
  /// Asks for the memory of places that will be fetched soon: the tile is larger than the nearest
  /// caches, and fine layers jump about in it.
  void prefetch(const Places& places) const {
    for (const std::int32_t first : places.first) {
      const std::int16_t* const voxel = voxels_.data() + first;
      _mm_prefetch(reinterpret_cast<const char*>(voxel), _MM_HINT_T0);
      _mm_prefetch(reinterpret_cast<const char*>(voxel + kNextY), _MM_HINT_T0);
      _mm_prefetch(reinterpret_cast<const char*>(voxel + kNextZ), _MM_HINT_T0);
      _mm_prefetch(reinterpret_cast<const char*>(voxel + kNextZ + kNextY), _MM_HINT_T0);
    }
  }
  /// The four channels. Across x in 15-bit integers, across y and z in single precision.
  Float4x4 fetch(const Places& p) const {
    const Float4 step = _mm_loadu_ps(step_.data());
    return transposed(fetch_one<0>(p) * step, fetch_one<1>(p) * step, fetch_one<2>(p) * step,
                      fetch_one<3>(p) * step);
  }
  Float4x4 fetch(const Float4x3& cells) const { return fetch(locate(cells)); }

 private:
  // The first voxel comes again at the end of each axis: the next one is always there.
  static constexpr int kStored = kVoxels + 1;
  static constexpr int kNextY = 4 * kStored, kNextZ = kNextY * kStored;
  static_assert(kNextZ < 1 << 15, "fits the 16-bit factors");
  static constexpr int kWeights = 32767;

  static Float4 mix(Float4 a, Float4 b, Float4 t) { return a + t * (b - a); }
  // Both voxels of a row in one load; each channel's pair is weighted and added in one step.
  static Float4 row(const std::int16_t* first, __m128i weights) {
    const __m128i both = _mm_loadu_si128(reinterpret_cast<const __m128i*>(first));
    const __m128i pairs = _mm_unpacklo_epi16(both, _mm_srli_si128(both, 8));
    return _mm_cvtepi32_ps(_mm_madd_epi16(pairs, weights));
  }
  template <int i>
  Float4 fetch_one(const Places& p) const {
    constexpr int kAll = _MM_SHUFFLE(i, i, i, i);
    const __m128i wx = _mm_shuffle_epi32(p.wx, kAll);
    const Float4 fy = _mm_shuffle_ps(p.fy, p.fy, kAll), fz = _mm_shuffle_ps(p.fz, p.fz, kAll);
    const std::int16_t* const at = voxels_.data() + p.first[i];
    const Float4 near = mix(row(at, wx), row(at + kNextY, wx), fy);
    const Float4 far = mix(row(at + kNextZ, wx), row(at + kNextZ + kNextY, wx), fy);
    return mix(near, far, fz);
  }

  std::vector<std::int16_t> voxels_;
  Channels step_;  // of one count
};

}  // namespace rugae
