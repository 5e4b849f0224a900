#include "core/portable_math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/units.h"

namespace rugae {
namespace {

// The largest errors that the header states; the library's own are far smaller.
constexpr double kShort = 1e-8, kShortTurn = 1e-6;
constexpr double kExact = 1e-15;  // relative
constexpr double kSine = 2e-16;   // absolute
constexpr double kLibrary = 0.6 * std::numeric_limits<double>::epsilon();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDenormal = std::numeric_limits<double>::denorm_min();

void expect_relative(double value, double expected, double tolerance, double at) {
  EXPECT_TRUE(std::abs(value - expected) <= tolerance * std::abs(expected))
      << at << ": " << value << ", expected " << expected;
}

TEST(PortableMath, ShortOnesAgreeWithTheLibrary) {
  for (double x = -40.0; x <= 0.0; x += 0.0137)
    expect_relative(portable_exp(x), std::exp(x), kShort, x);
  for (double x = 1e-6; x < 1e6; x *= 1.0137)
    EXPECT_TRUE(std::abs(portable_log(x) - std::log(x)) <= kShort) << x;
  for (double turns = -3.0; turns < 3.0; turns += 0.00137) {
    const SineCosine sc = portable_turn(turns);
    EXPECT_TRUE(std::abs(sc.sine - std::sin(2.0 * kPi * turns)) <= kShortTurn) << turns;
    EXPECT_TRUE(std::abs(sc.cosine - std::cos(2.0 * kPi * turns)) <= kShortTurn) << turns;
  }
  for (const double exponent : {0.0, 1.0 / 2.4, 0.5, 1.0, 2.4, 7.0})
    for (double base = 1e-5; base <= 1.0; base *= 1.0137)
      expect_relative(portable_power(base, exponent), std::pow(base, exponent),
                      kShort * (1.0 + exponent), base);
  EXPECT_TRUE(portable_power(1.0, 2.4) <= 1.0);
}

TEST(PortableMath, SineAndCosineAgreeWithTheLibrary) {
  const auto expect_at = [](double angle) {
    const SineCosine sc = portable_sin_cos(angle);
    EXPECT_TRUE(std::abs(sc.sine - std::sin(angle)) <= kSine + kLibrary) << angle;
    EXPECT_TRUE(std::abs(sc.cosine - std::cos(angle)) <= kSine + kLibrary) << angle;
  };
  for (double angle = -30.0; angle < 30.0; angle += 0.000137) expect_at(angle);
  for (double angle = 30.0; angle <= 1e6; angle += 7.77) {
    expect_at(angle);
    expect_at(-angle);
  }
  // Next to the multiples of a right angle, where one of them vanishes and the series changes.
  for (int quarters = -9; quarters <= 9; ++quarters)
    for (const double off : {0.0, 1e-300, 1e-16, 1e-9, 0.25 * kPi, -1e-9, -1e-16})
      expect_at(0.5 * kPi * quarters + off);
}

TEST(PortableMath, SineAndCosineAtTheEdges) {
  EXPECT_EQ(portable_sin_cos(0.0).sine, 0.0);
  EXPECT_EQ(portable_sin_cos(0.0).cosine, 1.0);
  EXPECT_EQ(portable_sin_cos(kDenormal).sine, kDenormal);
  EXPECT_EQ(portable_sin_cos(0.5 * kPi).sine, 1.0);
  EXPECT_EQ(portable_sin_cos(kPi).cosine, -1.0);
  EXPECT_NEAR(portable_sin_cos(kPi).sine, 1.2246467991473532e-16, 1e-20);  // of pi as a double
  for (const double beyond : {1.1e6, -1.1e6, kInfinity, -kInfinity, kNan}) {
    EXPECT_TRUE(std::isnan(portable_sin_cos(beyond).sine));
    EXPECT_TRUE(std::isnan(portable_sin_cos(beyond).cosine));
  }
}

TEST(PortableMath, Atan2AgreesWithTheLibrary) {
  for (double angle = -3.14159; angle < 3.1416; angle += 0.000137)
    for (const double length : {1e-300, 1.0, 1e300}) {
      const double x = length * std::cos(angle), y = length * std::sin(angle);
      expect_relative(portable_atan2(y, x), std::atan2(y, x), kExact + kLibrary, angle);
    }
  for (double ratio = 1e-300; ratio < 1e300; ratio *= 1.37)
    for (const double x : {1.0, -1.0})
      for (const double y : {ratio, -ratio})
        expect_relative(portable_atan2(y, x), std::atan2(y, x), kExact + kLibrary, ratio);
}

TEST(PortableMath, Atan2AtTheEdges) {
  EXPECT_EQ(portable_atan2(0.0, 0.0), 0.0);
  EXPECT_EQ(portable_atan2(0.0, 1.0), 0.0);
  EXPECT_EQ(portable_atan2(1.0, 0.0), 0.5 * kPi);
  EXPECT_EQ(portable_atan2(-1.0, 0.0), -0.5 * kPi);
  EXPECT_EQ(portable_atan2(0.0, -1.0), kPi);
  EXPECT_EQ(portable_atan2(-0.0, -1.0), kPi);
  EXPECT_DOUBLE_EQ(portable_atan2(2.0, 2.0), 0.25 * kPi);
  EXPECT_EQ(portable_atan2(kDenormal, 1.0), kDenormal);
  EXPECT_DOUBLE_EQ(portable_atan2(kDenormal, -kDenormal), 0.75 * kPi);
  EXPECT_EQ(portable_atan2(1.0, kInfinity), 0.0);
  EXPECT_EQ(portable_atan2(kInfinity, 1.0), 0.5 * kPi);
  EXPECT_TRUE(std::isnan(portable_atan2(kNan, 1.0)));
  EXPECT_TRUE(std::isnan(portable_atan2(1.0, kNan)));
  EXPECT_TRUE(std::isnan(portable_atan2(0.0, kNan)));
}

TEST(PortableMath, HyperbolicTangentAndCubeRootAgreeWithTheLibrary) {
  for (double x = -25.0; x < 25.0; x += 0.00137)
    expect_relative(portable_tanh(x), std::tanh(x), kExact + kLibrary, x);
  for (double x = 1e-300; x < 1.0; x *= 1.37)
    expect_relative(portable_tanh(x), std::tanh(x), kExact + kLibrary, x);
  EXPECT_EQ(portable_tanh(0.0), 0.0);
  EXPECT_EQ(portable_tanh(kInfinity), 1.0);
  EXPECT_EQ(portable_tanh(-kInfinity), -1.0);
  EXPECT_TRUE(std::isnan(portable_tanh(kNan)));

  for (double x = 1e-307; x < 1e307; x *= 1.37)
    expect_relative(portable_cbrt(x), std::cbrt(x), kExact + kLibrary, x);
  EXPECT_EQ(portable_cbrt(0.0), 0.0);
  EXPECT_EQ(portable_cbrt(27.0), 3.0);
  EXPECT_TRUE(std::isnan(portable_cbrt(-1.0)));
  EXPECT_TRUE(std::isnan(portable_cbrt(kNan)));
}

}  // namespace
}  // namespace rugae
