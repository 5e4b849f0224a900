#pragma once
// Noise computed once on a small periodic grid and read back by trilinear interpolation: the price
// of a fetch does not depend on what was computed. Four channels of 16 bits, 2 MB.

#include <emmintrin.h>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

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

  /// The four channels at `cells` (any finite position within 1e5 cells of 0).
  Channels fetch(const Vec3f& cells) const {
    // positions far below zero become positive before they are cut to integers
    constexpr float kScale = static_cast<float>(kVoxels) / kCells, kShift = 1 << 20;
    int i[3];
    float f[3];
    for (int a = 0; a < 3; ++a) {
      const double x = static_cast<double>(cells[a] * kScale) + kShift;
      i[a] = static_cast<int>(x);
      f[a] = static_cast<float>(x - i[a]);
    }
    constexpr int kMask = kVoxels - 1;
    const int x0 = i[0] & kMask, x1 = (i[0] + 1) & kMask;
    const int y0 = (i[1] & kMask) * kVoxels, y1 = ((i[1] + 1) & kMask) * kVoxels;
    const int z0 = (i[2] & kMask) * kVoxels * kVoxels,
              z1 = ((i[2] + 1) & kMask) * kVoxels * kVoxels;
    const __m128 fx = _mm_set1_ps(f[0]), fy = _mm_set1_ps(f[1]), fz = _mm_set1_ps(f[2]);
    const __m128 a = mix(row(x0, x1, y0 + z0, fx), row(x0, x1, y1 + z0, fx), fy);
    const __m128 b = mix(row(x0, x1, y0 + z1, fx), row(x0, x1, y1 + z1, fx), fy);
    Channels out;
    _mm_storeu_ps(out.data(), _mm_mul_ps(mix(a, b, fz), _mm_loadu_ps(step_.data())));
    return out;
  }

 private:
  static __m128 mix(__m128 a, __m128 b, __m128 t) {
    return _mm_add_ps(a, _mm_mul_ps(t, _mm_sub_ps(b, a)));
  }
  __m128 voxel(int index) const {
    const __m128i v = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(voxels_.data() + 4 * index));
    return _mm_cvtepi32_ps(_mm_srai_epi32(_mm_unpacklo_epi16(v, v), 16));  // sign-extended
  }
  __m128 row(int x0, int x1, int yz, __m128 t) const {
    return mix(voxel(x0 + yz), voxel(x1 + yz), t);
  }

  std::vector<std::int16_t> voxels_;
  Channels step_;  // of one count
};

}  // namespace rugae
