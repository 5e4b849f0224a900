#include "recon/corner_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/random.h"

namespace rugae {
namespace {

struct Drawn {
  Vec2 corner{20.3, 19.6};
  double across_rad = 0.2, down_rad = 1.7;
  double bright = 0.8, dark = 0.05;  // linear light
  Vec2 slope{0.0, 0.0};              // of the light, a pixel
  double gamma = 2.2;
  double noise = 0.0;  // grey levels
};

// 8 x 8 rays a pixel, then a tone curve.
cv::Mat draw(const Drawn& d) {
  constexpr int kSize = 40, kRays = 8;
  cv::Mat gray(kSize, kSize, CV_8U);
  const Vec2 across(std::cos(d.across_rad), std::sin(d.across_rad));
  const Vec2 down(std::cos(d.down_rad), std::sin(d.down_rad));
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      double sum = 0.0;
      for (int s = 0; s < kRays * kRays; ++s) {
        const Vec2 p =
            Vec2(x + (s % kRays + 0.5) / kRays, y + (s / kRays + 0.5) / kRays) - d.corner;
        const auto side = [&p](const Vec2& l) { return l.x() * p.y() - l.y() * p.x() > 0.0; };
        sum += (side(across) == side(down) ? d.bright : d.dark) * (1.0 + d.slope.dot(p));
      }
      const auto n = random_normal(1, Purpose::test, 9, static_cast<std::uint64_t>(y * kSize + x));
      gray.at<unsigned char>(y, x) = cv::saturate_cast<unsigned char>(
          255.0 * std::pow(std::max(0.0, sum / (kRays * kRays)), 1.0 / d.gamma) + d.noise * n[0]);
    }
  return gray;
}

std::optional<Vec2> found(const Drawn& d, const Vec2& off, double spacing_px,
                          double most_px = 1.5) {
  const double wrong_rad = 0.1;  // neighbours tell the lines' directions roughly
  const auto line = [&](double angle) {
    return Vec2(spacing_px * Vec2(std::cos(angle + wrong_rad), std::sin(angle + wrong_rad)));
  };
  return fit_corner(draw(d), {d.corner + off, line(d.across_rad), line(d.down_rad)}, most_px);
}

void expect_found(const Drawn& d, double spacing_px, double tolerance_px) {
  for (const Vec2& off : {Vec2(0.0, 0.0), Vec2(0.6, -0.5), Vec2(-0.7, 0.4)}) {
    const auto corner = found(d, off, spacing_px);
    ASSERT_TRUE(corner);
    EXPECT_LE((*corner - d.corner).norm(), tolerance_px) << off.transpose();
  }
}

TEST(CornerFit, FindsDrawnCornersWhateverTheToneCurve) {
  for (const double gamma : {1.0, 2.2})
    for (std::uint64_t i = 0; i < 8; ++i) {
      const auto u = random_uniform(1, Purpose::test, 10, i);
      Drawn d;
      d.corner = {18.0 + 3.0 * u[0], 18.0 + 3.0 * u[1]};
      d.across_rad = 6.28 * u[2];
      d.down_rad = d.across_rad + 1.1 + u[3];
      d.gamma = gamma;
      expect_found(d, 16.0, 0.02);
      expect_found(d, 6.0, 0.06);  // windows of 7 x 7 pixels
    }
}

TEST(CornerFit, BlackAndWhiteMayChangePlaces) {
  Drawn d;
  std::swap(d.bright, d.dark);
  expect_found(d, 16.0, 0.02);
}

TEST(CornerFit, LightThatFallsOffMovesNothing) {
  Drawn d;
  d.slope = {0.03, -0.02};
  expect_found(d, 12.0, 0.02);
}

TEST(CornerFit, NoiseMovesItLittle) {
  Drawn d;
  d.noise = 3.0;
  expect_found(d, 16.0, 0.05);
}

TEST(CornerFit, WhatIsNoCornerIsNotFitted) {
  Drawn flat;
  flat.bright = flat.dark = 0.4;
  EXPECT_FALSE(found(flat, {0, 0}, 16.0));  // nothing but noise
  Drawn d;
  EXPECT_FALSE(found(d, {0.6, 0.6}, 16.0, 0.5));  // farther away than may be
  cv::Mat random(40, 40, CV_8U);
  for (int i = 0; i < 1600; ++i)
    random.data[i] = static_cast<unsigned char>(
        255.0 * random_uniform(1, Purpose::test, 11, static_cast<std::uint64_t>(i))[0]);
  EXPECT_FALSE(fit_corner(random, {Vec2(20, 20), Vec2(16, 0), Vec2(0, 16)}, 1.5));
  // an edge, along which the corner could be anywhere
  Drawn edge;
  edge.down_rad = edge.across_rad + 1e-3;
  EXPECT_FALSE(found(edge, {0.2, 0.1}, 16.0));
}

}  // namespace
}  // namespace rugae
