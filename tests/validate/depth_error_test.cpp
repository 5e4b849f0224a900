#include "validate/depth_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/check.h"

namespace rugae {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kSingle = 1e-6;  // relative; images are 32-bit floats

cv::Mat ramp(float factor) {
  cv::Mat image(6, 8, CV_32F);
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 8; ++x) image.at<float>(y, x) = factor * (10.0f + x + 8.0f * y);
  return image;
}

TEST(DepthError, TheTruthHasNone) {
  const auto error = depth_error(ramp(1), ramp(1), 1.0);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->abs_rel, 0.0);
  EXPECT_EQ(error->rmse_mm, 0.0);
  EXPECT_EQ(error->rmse_log, 0.0);
  EXPECT_EQ(error->delta_125, 1.0);
  EXPECT_EQ(error->valid_share, 1.0);
}

// Depths 10 to 57 times 1.1: AbsRel = 0.1; SqRel = 0.01 mean(d*); RMSE = 0.1 rms(d*);
// RMSE log = ln 1.1.
TEST(DepthError, TenPercentTooDeepGivesExactValues) {
  const auto error = depth_error(ramp(1.1f), ramp(1), 1.0);
  ASSERT_TRUE(error);
  double sum = 0.0, squares = 0.0;
  for (int d = 10; d < 58; ++d) {
    sum += d;
    squares += static_cast<double>(d) * d;
  }
  EXPECT_NEAR(error->abs_rel, 0.1, kSingle);
  EXPECT_NEAR(error->sq_rel_mm, 0.01 * sum / 48, 10 * kSingle);
  EXPECT_NEAR(error->rmse_mm, 0.1 * std::sqrt(squares / 48), 10 * kSingle);
  EXPECT_NEAR(error->rmse_log, std::log(1.1), kSingle);
  EXPECT_EQ(error->delta_125, 1.0);
}

TEST(DepthError, DeltaCountsBothDirections) {
  cv::Mat truth(1, 4, CV_32F, cv::Scalar(100)), estimate(1, 4, CV_32F);
  estimate.at<float>(0) = 126;  // ratio 1.26
  estimate.at<float>(1) = 124;
  estimate.at<float>(2) = 79;  // ratio 1.266
  estimate.at<float>(3) = 81;
  EXPECT_EQ(depth_error(estimate, truth, 1.0)->delta_125, 0.5);
}

TEST(DepthError, TheScaleTurnsMapUnitsIntoMillimetres) {
  EXPECT_NEAR(depth_error(ramp(0.02f), ramp(1), 50.0)->abs_rel, 0.0, kSingle);
  EXPECT_NEAR(*median_scale(ramp(0.02f), ramp(1)), 50.0, 50 * kSingle);
  EXPECT_THROW(depth_error(ramp(1), ramp(1), 0.0), Error);
  EXPECT_THROW(depth_error(ramp(1), ramp(1), std::nan("")), Error);
}

TEST(DepthError, UnknownPixelsAreReportedInTheValidShare) {
  cv::Mat truth = ramp(1), estimate = ramp(1);
  truth.at<float>(0, 0) = kNan;      // 47 pixels of truth
  estimate.at<float>(0, 0) = 5.0f;   // not counted: no truth
  estimate.at<float>(2, 3) = kNan;   // lost
  estimate.at<float>(2, 4) = -1.0f;  // behind the camera: not a depth
  const auto error = depth_error(estimate, truth, 1.0);
  ASSERT_TRUE(error);
  EXPECT_DOUBLE_EQ(error->valid_share, 45.0 / 47.0);
  EXPECT_EQ(error->abs_rel, 0.0);
}

TEST(DepthError, NothingInCommonIsEmptyAndSizesMustAgree) {
  const cv::Mat none(6, 8, CV_32F, cv::Scalar(kNan));
  EXPECT_FALSE(depth_error(none, ramp(1), 1.0));
  EXPECT_FALSE(median_scale(none, ramp(1)));
  EXPECT_FALSE(mean_of({}));
  EXPECT_THROW(depth_error(cv::Mat(6, 7, CV_32F), ramp(1), 1.0), Error);
}

TEST(DepthError, EachFrameCountsTheSame) {
  DepthError a, b;
  a.abs_rel = 0.1;
  b.abs_rel = 0.3;
  const auto mean = mean_of({a, b});
  EXPECT_DOUBLE_EQ(mean->abs_rel, 0.2);
  EXPECT_EQ(mean->frames, 2.0);
}

}  // namespace
}  // namespace rugae
