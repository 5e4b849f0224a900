#include "recon/depth_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/random.h"

namespace rugae {
namespace {

constexpr double kMinSpread = 1e-6;

/// A slope, a bend and an ingredient of strength `scale`, at scattered places.
std::vector<FieldSample> samples_of(double scale, int count, double noise) {
  std::vector<FieldSample> samples;
  for (int i = 0; i < count; ++i) {
    const auto u = random_uniform(3, Purpose::test, 1, i);
    const auto n = random_normal(3, Purpose::test, 2, i);
    const Vec2 pixel(200 * u[0], 100 * u[1]);
    const double ingredient = std::sin(0.9 * pixel.x()) * std::cos(0.7 * pixel.y());
    const double smooth = 3.0 + 0.01 * pixel.x() - 0.004 * pixel.y() + 1e-5 * pixel.x() * pixel.x();
    samples.push_back({pixel, smooth + scale * ingredient + noise * n[0], ingredient, 1.0});
  }
  return samples;
}

TEST(DepthField, FindsTheScaleOfTheIngredientAndTheSmoothPart) {
  const auto field = fit_depth_field(samples_of(0.3, 600, 0.0), {200, 100}, 20.0, kMinSpread);
  ASSERT_TRUE(field);
  EXPECT_NEAR(field->scale, 0.3, 1e-3);
  // The spline holds a parabola but its penalty pulls against the bend: 1e-5 * 20^2 a cell.
  EXPECT_NEAR(field->spline({100, 50}), 3.0 + 1.0 - 0.2 + 0.1, 4e-3);
}

TEST(DepthField, WrongSamplesLoseTheirSay) {
  auto samples = samples_of(0.3, 600, 0.002);
  for (std::size_t i = 0; i < samples.size(); i += 7) samples[i].value += 2.0;
  const auto field = fit_depth_field(samples, {200, 100}, 20.0, kMinSpread);
  ASSERT_TRUE(field);
  EXPECT_NEAR(field->spline({100, 50}), 3.9, 0.01);
  EXPECT_NEAR(field->scale, 0.3, 0.01);
  for (std::size_t i = 0; i < samples.size(); i += 7) EXPECT_FALSE(field->kept[i]);
  // 9/10 of the others: a Gaussian keeps 99.7 % within three sigma.
  const auto kept = std::count(field->kept.begin(), field->kept.end(), true);
  EXPECT_GE(kept, 460);
}

TEST(DepthField, HeldOutErrorIsThatOfTheNoise) {
  constexpr double kNoise = 0.05;
  const auto field = fit_depth_field(samples_of(0.0, 800, kNoise), {200, 100}, 20.0, kMinSpread);
  ASSERT_TRUE(field);
  // Mean magnitude of a normal number is 0.8 sigma; the fit's own error adds a little.
  EXPECT_GE(field->held_out, 0.6 * kNoise);
  EXPECT_LE(field->held_out, 1.0 * kNoise);
}

TEST(DepthField, RefusesFewSamplesAndSamplesOnALine) {
  EXPECT_FALSE(fit_depth_field(samples_of(0.3, 8, 0.0), {200, 100}, 20.0, kMinSpread));
  auto line = samples_of(0.3, 100, 0.0);
  for (FieldSample& sample : line) sample.pixel.y() = 50.0;
  EXPECT_FALSE(fit_depth_field(line, {200, 100}, 20.0, kMinSpread));
}

}  // namespace
}  // namespace rugae
