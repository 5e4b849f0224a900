// The wall between what is known of it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "dense_scene.h"
#include "recon/dense/smooth_wall.h"

namespace rugae {
namespace {

using namespace testing;

constexpr double kDistance = 30.0;
constexpr float kSigmaShare = 0.003f;
const cv::Rect kGap(56, 40, 48, 40);  // of 160 x 120

DepthMap map_of(const cv::Mat& truth) {
  DepthMap map{small_grid(), Rigid3{}, truth.clone(), kSigmaShare * truth};
  map.depth(kGap).setTo(std::nanf(""));
  map.sigma(kGap).setTo(std::nanf(""));
  return map;
}

/// A prior that is wrong by a fifth.
DepthPrior prior_for(const cv::Mat& truth) {
  return {cv::Mat(60, 80, CV_32F, cv::Scalar(1.2 * cv::mean(truth)[0])), 0.3};
}

// Straight in inverse depth: nothing bends it but the prior. One that is wrong by a fifth may pull
// by a twentieth of that, the right one not at all.
TEST(SmoothWall, GoesOnAlongAPlane) {
  constexpr double kPull = 0.01, kExact = 1e-4;
  const DenseWall wall = plane_wall({0.3, -0.2, 1.0}, kDistance);
  const cv::Mat truth = true_depth(wall, Rigid3{}, small_grid());
  const DepthPrior right{true_depth(wall, Rigid3{}, halved(small_grid())), 0.3};
  const auto smooth = smooth_wall(map_of(truth), {}, right, 0);
  const auto pulled = smooth_wall(map_of(truth), {}, prior_for(truth), 0);
  ASSERT_TRUE(smooth && pulled);
  for (int y = kGap.y; y < kGap.br().y; ++y)
    for (int x = kGap.x; x < kGap.br().x; ++x) {
      const double z = truth.at<float>(y, x);
      ASSERT_NEAR(smooth->depth.at<float>(y, x), z, kExact * z);
      ASSERT_NEAR(pulled->depth.at<float>(y, x), z, kPull * z);
      const Vec3 ray = small_grid().ray(x, y).normalized();
      ASSERT_NEAR(smooth->cosine.at<float>(y, x), wall.normal({}).dot(ray), 1e-3);
    }
}

TEST(SmoothWall, KnowsLessTheFartherFromWhatIsKnown) {
  const cv::Mat truth = true_depth(sphere_wall(kDistance), Rigid3{}, small_grid());
  constexpr std::uint32_t kTimes = 16;  // a mean over draws: sigma is known to a few percent
  cv::Mat sigma(truth.size(), CV_32F, cv::Scalar(0.0));
  for (std::uint32_t number = 0; number < kTimes; ++number) {
    const auto smooth = smooth_wall(map_of(truth), {}, prior_for(truth), number);
    ASSERT_TRUE(smooth.has_value());
    sigma += smooth->sigma_share / kTimes;
  }
  EXPECT_GT(sigma.at<float>(60, 80), 1.2f * sigma.at<float>(60, 62));
  EXPECT_GT(sigma.at<float>(60, 62), 2.0f * sigma.at<float>(60, 30));
}

// Bumps that the model's bend allows for: errors are as large as it says.
TEST(SmoothWall, SigmaCoversTheErrorOfAWavyWall) {
  const cv::Mat plane = true_depth(plane_wall(Vec3::UnitZ(), kDistance), Rigid3{}, small_grid());
  std::vector<double> over_sigma;
  for (std::uint32_t draw = 0; draw < 10; ++draw) {
    const Mottling waves(draw + 1, 1.0, 5.0);  // 10 to 40 mm long
    cv::Mat truth = plane.clone();
    for (int y = 0; y < truth.rows; ++y)
      for (int x = 0; x < truth.cols; ++x)
        truth.at<float>(y, x) += static_cast<float>(waves(kDistance * small_grid().ray(x, y)));
    const auto smooth = smooth_wall(map_of(truth), {}, prior_for(truth), draw);
    ASSERT_TRUE(smooth.has_value());
    for (int y = kGap.y + 8; y < kGap.br().y - 8; y += 4)
      for (int x = kGap.x + 8; x < kGap.br().x - 8; x += 4)
        over_sigma.push_back(std::abs(smooth->depth.at<float>(y, x) / truth.at<float>(y, x) - 1.0) /
                             smooth->sigma_share.at<float>(y, x));
  }
  std::ranges::sort(over_sigma);
  const double median = over_sigma[over_sigma.size() / 2];
  // Of a normal distribution 0.67; missed by less than a factor of two.
  EXPECT_LE(median, 2.0 * 0.6745);
  EXPECT_GE(median, 0.5 * 0.6745);
}

TEST(SmoothWall, PointsInTheGapBendIt) {
  const cv::Mat truth = true_depth(plane_wall(Vec3::UnitZ(), kDistance), Rigid3{}, small_grid());
  std::vector<SparseDepth> points;
  for (double x = 74.0; x <= 86.0; x += 4.0)
    for (double y = 54.0; y <= 66.0; y += 4.0) points.push_back({{x, y}, 0.96 * kDistance});
  const auto smooth = smooth_wall(map_of(truth), points, prior_for(truth), 0);
  ASSERT_TRUE(smooth.has_value());
  EXPECT_NEAR(smooth->depth.at<float>(60, 80), 0.96 * kDistance, 0.01 * kDistance);
}

TEST(SmoothWall, WrongPointsBesideTheGapHaveLittleSay) {
  const cv::Mat truth = true_depth(plane_wall(Vec3::UnitZ(), kDistance), Rigid3{}, small_grid());
  std::vector<SparseDepth> points;
  for (double y = 42.0; y < 80.0; y += 8.0) points.push_back({{53.0, y}, 0.7 * kDistance});
  const auto smooth = smooth_wall(map_of(truth), points, prior_for(truth), 0);
  ASSERT_TRUE(smooth.has_value());
  EXPECT_NEAR(smooth->depth.at<float>(60, 60), kDistance, 0.01 * kDistance);
  EXPECT_NEAR(smooth->depth.at<float>(60, 80), kDistance, 0.01 * kDistance);
}

// A gap is filled, with what is right, as far as its wall is seen within 60 degrees, and no
// further, though it is known there as well.
TEST(SmoothWall, FillsGapsUnlessTheyAreSteep) {
  constexpr double kKnown = 0.05, kHorizon = 10.0 * kDistance;
  constexpr double kNearLimit = 0.03, kExact = 0.01;
  int flat = 0, steep = 0;
  for (const double tilt_rad : {0.7, 1.2}) {
    const DenseWall wall =
        plane_wall({0.0, std::sin(tilt_rad), std::cos(tilt_rad)}, 0.5 * kDistance);
    // Up to its horizon.
    const auto depth_on = [&](const PinholeGrid& grid) {
      cv::Mat depth = true_depth(wall, Rigid3{}, grid);
      depth.setTo(kHorizon, ~((depth > 0.0f) & (depth < kHorizon)));
      return depth;
    };
    const cv::Mat truth = depth_on(small_grid());
    const DepthPrior right{depth_on(halved(small_grid())), 0.3};
    DepthMap map = map_of(truth);
    const auto smooth = smooth_wall(map, {}, right, 0);
    ASSERT_TRUE(smooth.has_value());
    ASSERT_LT(cv::mean(smooth->sigma_share(kGap))[0], kKnown);
    const DepthMap before{map.grid, map.cam_from_world, map.depth.clone(), map.sigma.clone()};
    const cv::Mat filled = fill_from(*smooth, kKnown, map);
    EXPECT_EQ(cv::countNonZero(filled), cv::countNonZero(filled(kGap)));
    for (int y = kGap.y; y < kGap.br().y; ++y)
      for (int x = kGap.x; x < kGap.br().x; ++x) {
        const double cosine = wall.normal({}).dot(small_grid().ray(x, y).normalized());
        if (std::abs(cosine - 0.5) < kNearLimit) continue;
        ASSERT_EQ(filled.at<uchar>(y, x) > 0, cosine > 0.5) << x << " " << y << " " << cosine;
        ++(cosine > 0.5 ? flat : steep);
        if (cosine > 0.5) {
          ASSERT_NEAR(map.depth.at<float>(y, x) / truth.at<float>(y, x), 1.0, kExact);
          ASSERT_GT(map.sigma.at<float>(y, x), 0.0f);
        }
      }
    EXPECT_EQ(cv::norm(map.depth, before.depth, cv::NORM_INF, before.depth > 0.0f), 0.0);
  }
  EXPECT_GT(flat, kGap.area());
  EXPECT_GT(steep, kGap.area() / 2);
}

TEST(SmoothWall, NothingKnownOrNoPriorIsNoWall) {
  const cv::Mat truth = true_depth(plane_wall(Vec3::UnitZ(), kDistance), Rigid3{}, small_grid());
  DepthMap map = map_of(truth);
  EXPECT_FALSE(smooth_wall(map, {}, {}, 0).has_value());
  map.depth.setTo(std::nanf(""));
  EXPECT_FALSE(smooth_wall(map, {}, prior_for(truth), 0).has_value());
}

TEST(SmoothWall, ScalingTheWorldScalesTheDepthOnly) {
  constexpr float kScale = 1024.0f;
  const cv::Mat truth = true_depth(sphere_wall(kDistance), Rigid3{}, small_grid());
  const auto a = smooth_wall(map_of(truth), {}, prior_for(truth), 3);
  const cv::Mat larger = kScale * truth;
  const auto b = smooth_wall(map_of(larger), {}, prior_for(larger), 3);
  ASSERT_TRUE(a && b);
  EXPECT_LE(cv::norm(kScale * a->depth, b->depth, cv::NORM_INF), 1e-4 * kScale * kDistance);
  EXPECT_LE(cv::norm(a->sigma_share, b->sigma_share, cv::NORM_INF), 1e-4);
}

}  // namespace
}  // namespace rugae
