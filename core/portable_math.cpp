#include "core/portable_math.h"

#include <limits>

#include "core/units.h"

namespace rugae {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// atan t for 0 <= t <= 1. Twice atan t = 2 atan(t / (1 + sqrt(1 + t^2))) leaves t <= tan(pi / 16),
// where t - t^3/3 + t^5/5 - ... to t^23 is enough.
double short_atan(double t) {
  if (t < 1e-9) return t;  // to the last bit, and halves of the smallest doubles are 0
  for (int halving = 0; halving < 2; ++halving) t /= 1.0 + std::sqrt(1.0 + t * t);
  const double tt = t * t;
  double sum = 0.0;
  for (int k = 23; k >= 3; k -= 2) sum = tt * (1.0 / k - sum);
  return 4.0 * (t - t * sum);
}

}  // namespace

SineCosine portable_sin_cos(double angle_rad) {
  constexpr double kLargest_rad = 1e6;
  if (!(std::abs(angle_rad) <= kLargest_rad)) return {kNan, kNan};
  // pi/2 in three parts, the first two of 33 bits, so that their multiples are exact (Cody and
  // Waite, Software manual for the elementary functions, 1980; the parts as in fdlibm).
  constexpr double kPart1 = 1.57079632673412561417, kPart2 = 6.07710050630396597660e-11,
                   kPart3 = 2.02226624879595063154e-21;
  const double quarters = std::floor(angle_rad * (2.0 / kPi) + 0.5);
  const double a = ((angle_rad - quarters * kPart1) - quarters * kPart2) - quarters * kPart3;
  // |a| <= pi/4: sin a to a^17, cos a to a^18
  const double aa = a * a;
  double s = 0.0, c = 0.0;
  for (int k = 17; k >= 3; k -= 2) s = aa * (1.0 - s) / (k * (k - 1));
  for (int k = 18; k >= 4; k -= 2) c = aa * (1.0 - c) / (k * (k - 1));
  return SineCosine{a - a * s, 1.0 - 0.5 * aa * (1.0 - c)}.turned(
      static_cast<std::int64_t>(quarters));
}

double portable_atan2(double y, double x) {
  const double high = std::abs(y), wide = std::abs(x);
  if (high == 0.0 && wide == 0.0) return 0.0;
  double angle = high <= wide ? short_atan(high / wide) : 0.5 * kPi - short_atan(wide / high);
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

double portable_tanh(double x) {
  // Lambert's continued fraction x / (1 + x^2 / (3 + x^2 / (5 + ...)))
  constexpr double kIsOne = 20.0;  // from here on to the last bit
  const double held = x < -kIsOne ? -kIsOne : (x > kIsOne ? kIsOne : x);
  double below = 1.0;
  constexpr int kLast = 121;
  for (int k = kLast; k >= 1; k -= 2) below = k + held * held / below;
  return held / below;
}

double portable_cbrt(double x) {
  if (!(x > 0.0)) return x == 0.0 ? 0.0 : kNan;
  // A third of the bits is the root to about a tenth; each step of Newton's method doubles the
  // digits.
  constexpr std::uint64_t kTwoThirdsOfBias = 0x2A9F7893782DA1CEull;
  double root = std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) / 3 + kTwoThirdsOfBias);
  for (int step = 0; step < 5; ++step) root -= (root - x / (root * root)) / 3.0;
  return root;
}

}  // namespace rugae
