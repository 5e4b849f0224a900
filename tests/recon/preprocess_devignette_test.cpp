#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "recon/preprocess/devignette.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;
using testing::to_8bit;

constexpr int kWidth = 320, kHeight = 240;
const Vec2 kCenter(163.0, 118.0);
const double kReach = 0.5 * std::hypot(kWidth, kHeight);

// In the innermost rings a pixel is a large part of the ring and one 8-bit step (0.4 to 2 % of
// these walls) is not averaged out.
constexpr double kSmallestRing = 8.0;
// What is left in walls whose own gradients cancel: rounding to 8 bits moves a radial difference
// of ln I by at most 0.5 / 128 a pixel, random in sign; 0.29 / 128 / sqrt(1000 gradients a ring),
// summed over 180 rings as a random walk, is 0.1 %, and the smoothness straightens V'' by as much
// again. Ten times that.
constexpr double kTolerance = 0.01;

double true_v(double radius_px) {
  const double r = radius_px / kReach;
  return 1.0 - 0.5 * r * r;
}

double no_vignetting(double) { return 1.0; }

// Walls and their reciprocals, exp(a) and exp(-a): at each pixel the two gradients of ln I are
// opposite, so that what the method assumes, symmetric radial gradients, is exactly true, and any
// radial fall-off of the set is the lens'.
std::vector<cv::Mat> symmetric_walls(double (*v)(double)) {
  std::vector<cv::Mat> images;
  for (std::uint64_t i = 0; i < 4; ++i) {
    const Texture texture(100 + i, 6.0, 30.0);
    for (const double sign : {1.0, -1.0}) {
      images.push_back(to_8bit(draw(kWidth, kHeight, [&](const Vec2& p) {
        return 0.5 * std::exp(sign * (texture(p) - 0.5)) * v((p - kCenter).norm());
      })));
    }
  }
  return images;
}

// Different walls under one vignetting.
std::vector<cv::Mat> vignetted(int count, double (*v)(double) = true_v) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < count; ++i) {
    const Texture texture(100 + static_cast<std::uint64_t>(i), 6.0, 30.0);
    images.push_back(to_8bit(draw(kWidth, kHeight, [&](const Vec2& p) {
      return std::max(0.1, texture(p)) * v((p - kCenter).norm());
    })));
  }
  return images;
}

void expect_profile(const VignettingProfile& found, double (*v)(double)) {
  EXPECT_NEAR(found.at(0.0), 1.0, 1e-12);
  for (double r = kSmallestRing; r <= 0.9 * kReach; r += 4.0)
    EXPECT_NEAR(found.at(r) / v(r), 1.0, kTolerance) << r;
}

TEST(Devignette, RecoversAKnownProfile) {
  expect_profile(estimate_vignetting(symmetric_walls(true_v), {}, kCenter, kReach), true_v);
}

TEST(Devignette, WithoutVignettingTheProfileIsFlat) {
  expect_profile(estimate_vignetting(symmetric_walls(no_vignetting), {}, kCenter, kReach),
                 no_vignetting);
}

// Eight walls do not average out: what they have in common goes into the profile (see the header).
// But the profile of the same walls without vignetting shows how much that is, and the fall-off of
// the lens multiplies it.
TEST(Devignette, TheLensMultipliesWhatTheWallsHaveInCommon) {
  const VignettingProfile walls =
      estimate_vignetting(vignetted(8, no_vignetting), {}, kCenter, kReach);
  const VignettingProfile both = estimate_vignetting(vignetted(8), {}, kCenter, kReach);
  for (double r = kSmallestRing; r <= 0.9 * kReach; r += 4.0)
    EXPECT_NEAR(both.at(r) / walls.at(r) / true_v(r), 1.0, kTolerance) << r;
}

TEST(Devignette, CorrectionUndoesTheFallOff) {
  const std::vector<cv::Mat> images = vignetted(8);
  const VignettingProfile found = estimate_vignetting(images, {}, kCenter, kReach);
  const cv::Mat corrected = apply_gain(images[0], vignetting_gain(found, kWidth, kHeight));
  const cv::Mat clean = to_8bit(draw(kWidth, kHeight, Texture(100, 6.0, 30.0)));
  // Up to one gain over the whole image, which the centre's shade decides.
  const auto difference = [&](const cv::Mat& image) {
    const double gain = cv::mean(clean)[0] / cv::mean(image)[0];
    double sum = 0.0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        sum += std::abs(gain * image.at<unsigned char>(y, x) - clean.at<unsigned char>(y, x));
    return sum;
  };
  EXPECT_TRUE(difference(corrected) < 0.4 * difference(images[0]))
      << difference(corrected) / difference(images[0]);
}

TEST(Devignette, ExcludedPixelsDoNotCount) {
  std::vector<cv::Mat> images = symmetric_walls(true_v), masks;
  for (cv::Mat& image : images) {
    masks.emplace_back(kHeight, kWidth, CV_8U, cv::Scalar(255));
    const cv::Rect right(200, 0, 120, kHeight);
    masks.back()(right).setTo(0);
    for (int x = 200; x < kWidth; ++x) image.col(x).setTo(40 + (x - 200));  // a false ramp
  }
  expect_profile(estimate_vignetting(images, masks, kCenter, kReach), true_v);
}

TEST(Devignette, BlackImagesChangeNothing) {
  const std::vector<cv::Mat> black{cv::Mat::zeros(kHeight, kWidth, CV_8U)};
  const VignettingProfile found = estimate_vignetting(black, {}, kCenter, kReach);
  for (double r = 0.0; r <= kReach; r += 10.0) EXPECT_NEAR(found.at(r), 1.0, 1e-6);
}

}  // namespace
}  // namespace rugae
