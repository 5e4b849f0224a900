#pragma once
// Elementary functions from + - * / sqrt and exact bit operations only. The C library may pick
// another variant of exp, log or sin for another processor, and its last digit would change the
// frames; these give the same bits on every x86-64. The short ones are for what is asked millions
// of times, and their bits are part of every wall; the others are as exact as doubles.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace rugae {

/// exp(x) for x <= 0, relative error below 1e-8; 0 below -700.
inline double portable_exp(double x) {
  if (!(x > -700.0)) return 0.0;
  // x = n ln 2 + r with |r| <= ln 2 / 2; exp(r) by its Taylor polynomial of degree 7.
  constexpr double kLog2e = 1.4426950408889634, kLn2 = 0.6931471805599453;
  const double n = std::floor(x * kLog2e + 0.5);
  const double r = x - n * kLn2;
  double sum = 1.0 / 5040.0;
  for (const double c : {1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0})
    sum = sum * r + c;
  return sum * std::bit_cast<double>((static_cast<std::int64_t>(n) + 1023) << 52);
}

/// ln(x) for normal x > 0, absolute error below 1e-8.
inline double portable_log(double x) {
  // x = m 2^e with m in [1, 2); ln m = 2 atanh((m - c) / (m + c)) + ln c with c = sqrt 2.
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const double e = static_cast<double>(static_cast<std::int64_t>(bits >> 52) - 1023);
  const double m = std::bit_cast<double>((bits & 0xFFFFFFFFFFFFFull) | 0x3FF0000000000000ull);
  constexpr double kSqrt2 = 1.4142135623730951, kLn2 = 0.6931471805599453;
  const double z = (m - kSqrt2) / (m + kSqrt2), zz = z * z;
  double sum = 1.0 / 11.0;
  for (const double c : {1.0 / 9.0, 1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0, 1.0}) sum = sum * zz + c;
  return 2.0 * z * sum + (e + 0.5) * kLn2;
}

/// base^exponent for normal 0 < base <= 1 and exponent >= 0, relative error below
/// 1e-8 (1 + exponent).
inline double portable_power(double base, double exponent) {
  return portable_exp(std::min(0.0, exponent * portable_log(base)));
}

struct SineCosine {
  double sine, cosine;
  /// Of the angle `quarters` right angles farther.
  SineCosine turned(std::int64_t quarters) const {
    switch (quarters & 3) {
      case 0:
        return {sine, cosine};
      case 1:
        return {cosine, -sine};
      case 2:
        return {-sine, -cosine};
      default:
        return {-cosine, sine};
    }
  }
};

/// Sine and cosine of a full turn times `turns`, absolute error below 1e-6.
inline SineCosine portable_turn(double turns) {
  // a = the angle to the nearest quarter turn, at most pi/4; Taylor polynomials there
  const double quarters = std::floor(4.0 * turns + 0.5);
  const double a = (turns - 0.25 * quarters) * 6.283185307179586, aa = a * a;
  const double s = a * (1.0 + aa * (-1.0 / 6.0 + aa * (1.0 / 120.0 + aa * (-1.0 / 5040.0))));
  const double c =
      1.0 + aa * (-0.5 + aa * (1.0 / 24.0 + aa * (-1.0 / 720.0 + aa * (1.0 / 40320.0))));
  return SineCosine{s, c}.turned(static_cast<std::int64_t>(quarters));
}

/// Sine and cosine of an angle of at most 1e6 rad, absolute error below 2e-16; NaN beyond.
SineCosine portable_sin_cos(double angle_rad);

/// Angle of the vector (x, y) from the x axis in (-pi, pi], relative error below 1e-15; 0 for the
/// vector (0, 0), NaN if either is or both are infinite.
double portable_atan2(double y, double x);

/// Hyperbolic tangent, relative error below 1e-15.
double portable_tanh(double x);

/// Cube root of a normal x > 0, relative error below 1e-15.
double portable_cbrt(double x);

/// 0 below `from`, 1 above `to`, 3 t^2 - 2 t^3 between; `from` may be above `to`.
template <typename T>
inline T smooth_step(T from, T to, T x) {
  T t = (x - from) / (to - from);
  t = t < T(0) ? T(0) : (t > T(1) ? T(1) : t);
  return t * t * (T(3) - T(2) * t);
}

}  // namespace rugae
