#pragma once
// Eight numbers at once, for functions that are compiled for AVX2 as well as for what every x86-64
// has (gnu::target_clones): a register there, two here. The same operations, so the same numbers:
// fused multiply-add is not part of AVX2. GCC and Clang give them + - * / and & among each other
// and with one number. They are no arguments of functions that are not inlined: where those would
// look for them depends on the processor.

#include <cstring>

#include "core/float4.h"

namespace rugae {

using Float8 [[gnu::vector_size(32)]] = float;
using Int8 [[gnu::vector_size(32)]] = int;

/// The eight numbers at p, wherever it points.
[[gnu::always_inline]] inline void load(const float* p, Float8& eight) {
  std::memcpy(&eight, p, sizeof eight);
}
[[gnu::always_inline]] inline void load(const int* p, Int8& eight) {
  std::memcpy(&eight, p, sizeof eight);
}

/// a and b, one behind the other.
[[gnu::always_inline]] inline void join(Float4 a, Float4 b, Float8& eight) {
  eight = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// p[at[i]] and p[at[i] + 1].
[[gnu::always_inline]] inline void neighbours(const float* p, const int (&at)[8], Float8& left,
                                              Float8& right) {
  Float8 outer, inner;
  join(two_and_two(p + at[0], p + at[1]), two_and_two(p + at[4], p + at[5]), outer);
  join(two_and_two(p + at[2], p + at[3]), two_and_two(p + at[6], p + at[7]), inner);
  left = __builtin_shufflevector(outer, inner, 0, 2, 8, 10, 4, 6, 12, 14);
  right = __builtin_shufflevector(outer, inner, 1, 3, 9, 11, 5, 7, 13, 15);
}

/// Of the lanes, in double; pairs first, so that no sum waits for all before it.
inline double sum_of(Float4 v) {
  float lane[4];
  _mm_storeu_ps(lane, v);
  return (static_cast<double>(lane[0]) + lane[1]) + (static_cast<double>(lane[2]) + lane[3]);
}
[[gnu::always_inline]] inline double sum_of(const Float8& v) {
  const auto two = [&v](int i) { return static_cast<double>(v[i]) + v[i + 1]; };
  return (two(0) + two(2)) + (two(4) + two(6));
}

}  // namespace rugae
