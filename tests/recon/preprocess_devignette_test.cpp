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

// The few pixels at the centre do not average out the wall's own shade; the profile is therefore
// compared from a ring of 200 pixels on, relative to a ring in the middle. Eight walls of 30 %
// contrast with marks of about 15 px leave 0.3 / sqrt(8 * 200 px / 15 px) = 3 % there; nearer
// to the centre up to 12 % was seen.
constexpr double kSmallestRing = 32.0, kAnchor = 80.0, kTolerance = 0.08;

double shape(const VignettingProfile& profile, double radius_px) {
  return profile.at(radius_px) / profile.at(kAnchor);
}

double true_v(double radius_px) {
  const double r = radius_px / kReach;
  return 1.0 - 0.5 * r * r;
}

// Different walls under one vignetting.
std::vector<cv::Mat> vignetted(int count) {
  std::vector<cv::Mat> images;
  for (int i = 0; i < count; ++i) {
    const Texture texture(100 + static_cast<std::uint64_t>(i), 6.0, 30.0);
    images.push_back(to_8bit(draw(kWidth, kHeight, [&](const Vec2& p) {
      return std::max(0.05, texture(p)) * true_v((p - kCenter).norm());
    })));
  }
  return images;
}

TEST(Devignette, RecoversAKnownProfile) {
  const VignettingProfile found = estimate_vignetting(vignetted(8), {}, kCenter, kReach);
  EXPECT_NEAR(found.at(0.0), 1.0, 1e-12);
  for (double r = kSmallestRing; r <= 0.9 * kReach; r += 10.0) {
    EXPECT_NEAR(shape(found, r), true_v(r) / true_v(kAnchor), kTolerance) << r;
  }
}

TEST(Devignette, WithoutVignettingTheProfileIsFlat) {
  std::vector<cv::Mat> images;
  for (std::uint64_t i = 0; i < 8; ++i)
    images.push_back(to_8bit(draw(kWidth, kHeight, Texture(i, 6.0, 30.0))));
  const VignettingProfile found = estimate_vignetting(images, {}, kCenter, kReach);
  for (double r = kSmallestRing; r <= 0.9 * kReach; r += 10.0)
    EXPECT_NEAR(shape(found, r), 1.0, kTolerance) << r;
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
  std::vector<cv::Mat> images = vignetted(8), masks;
  for (cv::Mat& image : images) {
    masks.emplace_back(kHeight, kWidth, CV_8U, cv::Scalar(255));
    const cv::Rect right(200, 0, 120, kHeight);
    masks.back()(right).setTo(0);
    for (int x = 200; x < kWidth; ++x) image.col(x).setTo(40 + (x - 200));  // a false ramp
  }
  const VignettingProfile found = estimate_vignetting(images, masks, kCenter, kReach);
  for (double r = kSmallestRing; r <= 0.9 * kReach; r += 10.0)
    EXPECT_NEAR(shape(found, r), true_v(r) / true_v(kAnchor), 1.5 * kTolerance) << r;
}

TEST(Devignette, BlackImagesChangeNothing) {
  const std::vector<cv::Mat> black{cv::Mat::zeros(kHeight, kWidth, CV_8U)};
  const VignettingProfile found = estimate_vignetting(black, {}, kCenter, kReach);
  for (double r = 0.0; r <= kReach; r += 10.0) EXPECT_NEAR(found.at(r), 1.0, 1e-6);
}

}  // namespace
}  // namespace rugae
