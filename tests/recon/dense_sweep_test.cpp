// Correlation along surfaces against the formula, in double precision and one window at a time.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "core/units.h"
#include "recon/dense/sweep.h"

namespace rugae {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kHeight = 23;
constexpr double kDepth = 20.0;
/// Sums of some hundred floats of 0.2, squared, slid over as many rows and columns.
constexpr double kTolerance = 2e-4;
/// As documented: of a window, and contrast (squared) that is noise.
constexpr double kMinSeen = 0.6, kNoise = 0.0025 * 0.0025;

/// Texture with some holes.
StereoImage picture(int width, int seed) {
  StereoImage image{{width, kHeight, 50.0, 50.0, 0.5 * width, 0.5 * kHeight},
                    cv::Mat(kHeight, width, CV_32F)};
  cv::RNG rng(static_cast<std::uint64_t>(seed));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < width; ++x)
      image.texture.at<float>(y, x) =
          rng.uniform(0, 40) == 0
              ? kNaN
              : static_cast<float>(0.2 * std::sin(0.9 * x + 0.4 * y) + rng.gaussian(0.05));
  return image;
}

/// Half of what one sees is also in the other.
void mix(StereoImage& image, const StereoImage& other) {
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < image.texture.cols; ++x)
      image.texture.at<float>(y, x) += other.texture.at<float>(y, x);
}

double at(const cv::Mat& texture, double u, double v) {
  if (!(u >= 0.0 && v >= 0.0 && u < texture.cols - 1 && v < texture.rows - 1)) return kNaN;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const auto along = [&](int row) {
    return (1.0 - (u - x)) * texture.at<float>(row, x) + (u - x) * texture.at<float>(row, x + 1);
  };
  return (1.0 - (v - y)) * along(y) + (v - y) * along(y + 1);
}

/// Of the windows around (x, y), the source shifted by (dx, dy) pixels.
double correlation(const cv::Mat& reference, const cv::Mat& source, double dx, double dy, int x,
                   int y, int radius) {
  double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (int v = std::max(0, y - radius); v <= std::min(kHeight - 1, y + radius); ++v)
    for (int u = std::max(0, x - radius); u <= std::min(reference.cols - 1, x + radius); ++u) {
      const double r = reference.at<float>(v, u), s = at(source, u + dx, v + dy);
      if (!std::isfinite(r) || !std::isfinite(s)) continue;
      n += 1.0, a += r, b += s, aa += r * r, bb += s * s, ab += r * s;
    }
  const int side = 2 * radius + 1;
  if (n < kMinSeen * side * side) return kNaN;
  return (ab - a * b / n) /
         std::sqrt((aa - a * a / n + kNoise * n) * (bb - b * b / n + kNoise * n));
}

/// Of the known ones, at least two.
double mean_of_better_half(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.size() < 2) return kNaN;
  std::ranges::sort(values, std::greater<>());
  values.resize(std::max<std::size_t>(2, (values.size() + 1) / 2));
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

struct Case {
  int width, radius;
};

class Sweep : public ::testing::TestWithParam<Case> {};

TEST_P(Sweep, ScoresAreTheFormulas) {
  const auto [width, radius] = GetParam();
  const StereoImage reference = picture(width, 1);
  std::vector<StereoImage> images;
  for (int s = 0; s < 5; ++s) {
    images.push_back(picture(width, s + 2));
    if (s < 4) mix(images.back(), reference);
  }
  // Pixels that the sources are off, one so far that it sees little. None is whole at any depth:
  // between two pixels rounding would say which one's hole counts.
  const std::vector<Vec2> shifts = {
      {0.97, 0.06}, {0.4, -0.7}, {-2.55, 1.25}, {0.7 * width + 0.237, 0.1}, {0.15, 3.53}};
  std::vector<SweepSource> sources;
  for (std::size_t s = 0; s < images.size(); ++s)
    sources.push_back(
        {&images[s], Rigid3{Quat::Identity(), Vec3(shifts[s].x(), shifts[s].y(), 0.0) *
                                                  (kDepth / reference.grid.fx)}});
  const cv::Mat surface(kHeight, width, CV_32F, cv::Scalar(kDepth));
  const SweepRange range{0.1, 1};
  const ScoreVolume volume = sweep(reference, sources, surface, range, radius);
  int known = 0, unknown = 0;
  for (int k = -1; k <= 1; ++k)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < width; ++x) {
        std::vector<double> scores;
        for (std::size_t s = 0; s < images.size(); ++s) {
          const Vec2 shift = shifts[s] * std::exp(-range.step_ln * k);
          scores.push_back(correlation(reference.texture, images[s].texture, shift.x(), shift.y(),
                                       x, y, radius));
        }
        const double expected = mean_of_better_half(scores), found = volume.at(x, y)[k + 1];
        ASSERT_EQ(std::isfinite(expected), std::isfinite(found)) << x << " " << y << " " << k;
        (std::isfinite(expected) ? known : unknown) += 1;
        if (std::isfinite(expected)) {
          ASSERT_NEAR(found, expected, kTolerance) << x << " " << y;
        }
      }
  EXPECT_GT(known, width * kHeight / 2);
  EXPECT_GT(unknown, 0);
}

INSTANTIATE_TEST_SUITE_P(Widths, Sweep,
                         ::testing::Values(Case{64, 4}, Case{61, 4}, Case{62, 6}, Case{35, 1},
                                           Case{14, 6}));

TEST(SweepBehind, WhatIsBehindTheSourceIsNotSeen) {
  const StereoImage image = picture(40, 1);
  const Rigid3 turned(Quat(Eigen::AngleAxisd(kPi, Vec3::UnitY())), Vec3::Zero());
  const cv::Mat surface(kHeight, 40, CV_32F, cv::Scalar(kDepth));
  const ScoreVolume volume =
      sweep(image, {{&image, turned}, {&image, turned}}, surface, {0.1, 1}, 2);
  EXPECT_TRUE(std::ranges::none_of(volume.scores, [](float s) { return std::isfinite(s); }));
}

}  // namespace
}  // namespace rugae
