#include "recon/small_blur.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "recon/masked_blur.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;

constexpr double kNoise = 0.25;  // standard deviation

// A texture and as much noise: every frequency that a picture holds.
cv::Mat picture(cv::Size size) {
  const Texture texture(2, 7.0, 60.0);
  cv::Mat values = draw(size.width, size.height, [&](const Vec2& p) { return texture(p); });
  cv::Mat noise(size, CV_32F);
  cv::RNG random(5);
  random.fill(noise, cv::RNG::NORMAL, 0.0, kNoise);
  values.convertTo(values, CV_32F);
  return values + noise;
}

class SmallBlur : public ::testing::TestWithParam<std::tuple<cv::Size, double, int>> {};

TEST_P(SmallBlur, EnlargedIsTheGaussian) {
  const auto [size, sigma_px, border] = GetParam();
  const cv::Mat values = picture(size);
  cv::Mat exact, ours;
  cv::GaussianBlur(values, exact, {}, sigma_px, sigma_px, border);
  cv::resize(small_blur(values, sigma_px, border), ours, size, 0, 0, cv::INTER_LINEAR);
  cv::Scalar mean, contrast;
  cv::meanStdDev(values, mean, contrast);
  const cv::Rect everywhere({0, 0}, size);
  const int inner = static_cast<int>(3.0 * sigma_px);
  const cv::Rect middle(inner, inner, size.width - 2 * inner, size.height - 2 * inner);
  // With nothing beyond the border the blur falls steeply towards it, and enlarging has no pixel
  // there to follow: half a small picture's pixel is flat.
  constexpr double kWorst = 0.02, kWorstAtTheFall = 0.15;
  const auto worst = [&](const cv::Rect& part) {
    return cv::norm(exact(part), ours(part), cv::NORM_INF) / contrast[0];
  };
  EXPECT_TRUE(worst(middle) <= kWorst) << worst(middle);
  EXPECT_TRUE(worst(everywhere) <= (border == cv::BORDER_CONSTANT ? kWorstAtTheFall : kWorst))
      << worst(everywhere);
}

INSTANTIATE_TEST_SUITE_P(
    Sizes, SmallBlur,
    ::testing::Combine(::testing::Values(cv::Size(640, 480), cv::Size(321, 247)),
                       ::testing::Values(2.0, 6.5, 14.2, 30.0),
                       ::testing::Values(cv::BORDER_REFLECT, cv::BORDER_CONSTANT)));

TEST(SmallBlur, IsAsWideAsAsked) {
  // A Gaussian's variance and the blur's add up.
  constexpr int kSize = 480;
  constexpr double kOwnSigmaPx = 12.0;
  const cv::Mat along = cv::getGaussianKernel(kSize, kOwnSigmaPx, CV_32F);
  const cv::Mat spot = along * along.t();
  cv::Mat blurred;
  for (const double sigma_px : {2.0, 6.5, 9.5, 14.2, 30.0}) {
    cv::resize(small_blur(spot, sigma_px, cv::BORDER_CONSTANT), blurred, spot.size(), 0, 0,
               cv::INTER_LINEAR);
    const cv::Moments m = cv::moments(blurred);
    constexpr double kShare = 0.005;  // OpenCV cuts Gaussians off at four sigma
    EXPECT_NEAR(m.mu20 / m.m00 - kOwnSigmaPx * kOwnSigmaPx, sigma_px * sigma_px,
                kShare * sigma_px * sigma_px);
  }
}

TEST(MaskedBlur, OfAConstantIsTheConstantWhereItIsKnown) {
  cv::Mat known(cv::Size(160, 120), CV_8U, cv::Scalar(255)), values(known.size(), CV_32F);
  known(cv::Rect(40, 30, 50, 20)).setTo(0);
  values.setTo(3.0F);
  values.setTo(1000.0F, known == 0);  // of which nothing may be seen
  for (const double sigma_px : {1.5, 9.0, 20.0}) {
    const cv::Mat mean = masked_blur(values, known, sigma_px);
    constexpr double kRounding = 1e-4;
    EXPECT_TRUE(cv::norm(mean, cv::Mat(mean.size(), CV_32F, cv::Scalar(3.0)), cv::NORM_INF,
                         known) <= kRounding);
    EXPECT_EQ(cv::norm(mean, cv::NORM_INF, known == 0), 0.0);
  }
}

}  // namespace
}  // namespace rugae
