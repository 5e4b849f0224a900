#include "studies/tone_curve.h"

#include <gtest/gtest.h>

#include "render/isp.h"

namespace rugae {
namespace {

TEST(ToneCurve, IsTheSensorsAndHasAnInverse) {
  for (const Tone tone : {Tone::srgb, Tone::gamma22, Tone::linear})
    for (double linear = 0.0; linear <= 1.0; linear += 1.0 / 512.0) {
      const ToneCurve curve(tone);
      // display_value() is good to 1e-7.
      EXPECT_NEAR(curve.stored(linear), display_value(tone, linear), 1e-7);
      EXPECT_NEAR(curve.linear(curve.stored(linear)), linear, 1e-9);
    }
}

TEST(ToneCurve, DimmedLightIsStoredByTheExponent) {
  for (const Tone tone : {Tone::srgb, Tone::gamma22, Tone::linear}) {
    const ToneCurve curve(tone);
    for (const double v : {0.9, 0.5, 0.2})
      for (const double light : {0.01, 0.3, 2.0}) {  // before the dimming; beyond white as well
        const double stored = curve.stored(v * light);
        const double e = curve.exponent(stored, std::log(v));
        EXPECT_NEAR(std::pow(v, e) * curve.stored(light), stored, 1e-9);
        if (tone != Tone::srgb) {
          EXPECT_NEAR(e, tone == Tone::linear ? 1.0 : 1.0 / 2.2, 1e-9);
        }
      }
    // Nothing dimmed: the slope.
    constexpr double kStep = 1e-6;
    const double slope = std::log(curve.stored(0.3) / curve.stored(0.3 * std::exp(-kStep))) / kStep;
    EXPECT_NEAR(curve.exponent(curve.stored(0.3), 0.0), slope, 1e-3);
  }
}

}  // namespace
}  // namespace rugae
