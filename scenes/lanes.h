#pragma once
// Four floats at once, SSE2: what every x86-64 has, so that no result depends on the processor.
// GCC and Clang give __m128 the operators + - *.

#include <emmintrin.h>

#include "core/types.h"

namespace rugae {

using Lanes = __m128;

inline Lanes splat(float v) { return _mm_set1_ps(v); }
inline Lanes lanes(float x, float y, float z, float w = 0.0f) { return _mm_setr_ps(x, y, z, w); }
inline Lanes lanes(const Vec3f& v) { return _mm_setr_ps(v.x(), v.y(), v.z(), 0.0f); }
template <int i>
inline Lanes broadcast(Lanes v) {
  return _mm_shuffle_ps(v, v, _MM_SHUFFLE(i, i, i, i));
}
template <int i>
inline float lane(Lanes v) {
  return _mm_cvtss_f32(broadcast<i>(v));
}
/// x x' + y y' + z z', in that order, in every lane.
inline Lanes dot3(Lanes a, Lanes b) {
  const Lanes p = a * b;
  return broadcast<0>(p) + broadcast<1>(p) + broadcast<2>(p);
}
inline Vec3f vec3(Lanes v) {
  alignas(16) float f[4];
  _mm_store_ps(f, v);
  return {f[0], f[1], f[2]};
}

/// A rotation by its columns.
struct Turn {
  Lanes column[3];
  Lanes operator*(Lanes v) const {
    return column[0] * broadcast<0>(v) + column[1] * broadcast<1>(v) + column[2] * broadcast<2>(v);
  }
};

}  // namespace rugae
