#pragma once
// Four numbers at once, SSE2: what every x86-64 has, so that no result depends on the processor.
// Where wider registers pay, a function is compiled for AVX2 as well (gnu::target_clones), chosen
// as the program starts: the same operations, for fused multiply-add is not part of AVX2.
// Float4x3 are three numbers of four places: a lane is a place. GCC and Clang give __m128 the
// operators + - * /.

#include <emmintrin.h>

#include <cmath>

#include "core/types.h"

namespace rugae {

using Float4 = __m128;

struct Float4x3 {
  Float4 x, y, z;
};
struct Float4x4 {
  Float4 x, y, z, w;
};

inline Float4 splat(float v) { return _mm_set1_ps(v); }
inline Float4 min(Float4 a, Float4 b) { return _mm_min_ps(a, b); }
inline Float4 max(Float4 a, Float4 b) { return _mm_max_ps(a, b); }
inline Float4 clamp01(Float4 v) { return min(max(v, _mm_setzero_ps()), splat(1.0f)); }
/// `a` where the mask of a comparison is set, `b` elsewhere.
inline Float4 select(Float4 mask, Float4 a, Float4 b) {
  return _mm_or_ps(_mm_and_ps(mask, a), _mm_andnot_ps(mask, b));
}
inline Float4 root(Float4 v) { return _mm_sqrt_ps(v); }
inline float root(float v) { return std::sqrt(v); }
/// `v` where x > 0 (false for NaN), 0 elsewhere; of one number or four.
inline Float4 where_positive(Float4 x, Float4 v) {
  return _mm_and_ps(_mm_cmpgt_ps(x, _mm_setzero_ps()), v);
}
inline float where_positive(float x, float v) { return x > 0.0f ? v : 0.0f; }
inline Float4 above(Float4 a, Float4 b) { return _mm_cmpgt_ps(a, b); }
inline bool any(Float4 mask) { return _mm_movemask_ps(mask) != 0; }
inline bool all(Float4 mask) { return _mm_movemask_ps(mask) == 15; }

inline Float4x3 operator+(const Float4x3& a, const Float4x3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Float4x3 operator-(const Float4x3& a, const Float4x3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Float4x3 operator*(const Float4x3& a, Float4 b) { return {a.x * b, a.y * b, a.z * b}; }
inline Float4x3 operator*(const Float4x3& a, float b) { return a * splat(b); }
inline Float4 dot(const Float4x3& a, const Float4x3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Float4x3 select(Float4 mask, const Float4x3& a, const Float4x3& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
inline Float4x3 first3(const Float4x4& v) { return {v.x, v.y, v.z}; }

/// Four lists of four, one a place, become the lanes of four numbers.
inline Float4x4 transposed(Float4 a, Float4 b, Float4 c, Float4 d) {
  _MM_TRANSPOSE4_PS(a, b, c, d);
  return {a, b, c, d};
}

/// p[0], p[1], q[0], q[1].
inline Float4 two_and_two(const float* p, const float* q) {
  const Float4 low = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(p));
  return _mm_loadh_pi(low, reinterpret_cast<const __m64*>(q));
}

/// Whole part towards minus infinity (within 2^31) and what is left, 0 to 1.
struct Floor {
  __m128i whole;
  Float4 part;
};
inline Floor floor_of(Float4 v) {
  // truncation rounds negative numbers up, so those step down by one
  const __m128i towards_zero = _mm_cvttps_epi32(v);
  const Float4 part = v - _mm_cvtepi32_ps(towards_zero);
  const Float4 below = _mm_cmplt_ps(part, _mm_setzero_ps());
  return {_mm_add_epi32(towards_zero, _mm_castps_si128(below)),
          part + _mm_and_ps(below, splat(1.0f))};
}

/// A rotation, row by row.
struct Turn {
  float row[3][3];
  Float4x3 operator*(const Float4x3& v) const {
    const auto along = [&v](const float(&r)[3]) {
      return splat(r[0]) * v.x + splat(r[1]) * v.y + splat(r[2]) * v.z;
    };
    return {along(row[0]), along(row[1]), along(row[2])};
  }
  constexpr Turn inverse() const {
    return {{{row[0][0], row[1][0], row[2][0]},
             {row[0][1], row[1][1], row[2][1]},
             {row[0][2], row[1][2], row[2][2]}}};
  }
};

}  // namespace rugae
