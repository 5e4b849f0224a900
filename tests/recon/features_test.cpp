#include "recon/features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;
using testing::to_8bit;

constexpr int kWidth = 320, kHeight = 240;

class Features : public ::testing::TestWithParam<FeatureMethod> {};

TEST_P(Features, MatchesAreWhereTheHomographySays) {
  const Texture texture(1, 7.0, 40.0);
  Mat3 first_from_second;
  first_from_second << 1.01, 0.02, 3.0, -0.015, 0.99, 5.0, 1e-5, -2e-5, 1.0;
  const cv::Mat first = to_8bit(draw(kWidth, kHeight, texture));
  const cv::Mat second = to_8bit(draw(kWidth, kHeight, [&](const Vec2& p) {
    return texture((first_from_second * p.homogeneous()).hnormalized());
  }));
  const FeatureMatches matches = match_features(GetParam(), first, second);
  std::vector<double> errors;
  for (std::size_t i = 0; i < matches.first_px.size(); ++i)
    errors.push_back(((first_from_second * matches.second_px[i].homogeneous()).hnormalized() -
                      matches.first_px[i])
                         .norm());
  ASSERT_GE(errors.size(), 40u) << name_of(GetParam());
  std::sort(errors.begin(), errors.end());
  // Corners by HOG and ORB lie on whole pixels (of a pyramid), each wrong by half a pixel at most.
  EXPECT_TRUE(errors[errors.size() / 2] <= 0.71) << errors[errors.size() / 2];

  ReprojectedMatches led = reproject(matches, 1);
  ASSERT_TRUE(led.homography_found);
  ASSERT_EQ(led.error_px.size(), errors.size());
  EXPECT_GE(led.inliers, 30);
  EXPECT_EQ(led.error_px, reproject(matches, 1).error_px);
  std::vector<double> of_inliers;
  for (std::size_t i = 0; i < led.inlier.size(); ++i)
    if (led.inlier[i]) of_inliers.push_back(led.error_px[i]);
  ASSERT_EQ(of_inliers.size(), static_cast<std::size_t>(led.inliers));
  std::ranges::sort(of_inliers);
  EXPECT_TRUE(of_inliers[of_inliers.size() / 2] <= 1.0) << of_inliers[of_inliers.size() / 2];
}

TEST_P(Features, BlankImagesGiveNoHomography) {
  const cv::Mat gray(kHeight, kWidth, CV_8U, cv::Scalar(100));
  const ReprojectedMatches led = reproject(match_features(GetParam(), gray, gray), 1);
  EXPECT_FALSE(led.homography_found);
  EXPECT_EQ(led.inliers, 0);
}

INSTANTIATE_TEST_SUITE_P(All, Features, ::testing::ValuesIn(kFeatureMethods), [](const auto& info) {
  std::string name = name_of(info.param);
  std::erase(name, '-');
  return name;
});

// Exact matches under a homography, and among them some that are 40 px off: the exact ones are the
// inliers and have no error, and the wrong ones keep theirs.
TEST(Reproject, ExactMatchesHaveNoErrorAndWrongOnesTheirOwn) {
  Mat3 first_from_second;
  first_from_second << 1.02, 0.01, 4.0, -0.02, 0.98, -3.0, 2e-5, -1e-5, 1.0;
  FeatureMatches matches;
  constexpr double kOff_px = 40.0;
  for (int i = 0; i < 60; ++i) {
    const Vec2 second(20.0 + 37.0 * (i % 8) + i, 15.0 + 25.0 * (i / 8));
    const Vec2 first = (first_from_second * second.homogeneous()).hnormalized();
    matches.second_px.push_back(second);
    matches.first_px.push_back(i % 6 == 0 ? Vec2(first + Vec2(0.0, kOff_px)) : first);
  }
  const ReprojectedMatches led = reproject(matches, 3);
  ASSERT_TRUE(led.homography_found);
  EXPECT_EQ(led.inliers, 50);
  constexpr double kFitted_px = 1e-4;  // OpenCV's refinement
  for (int i = 0; i < 60; ++i) {
    EXPECT_EQ(led.inlier[i], i % 6 == 0 ? 0 : 1) << i;
    EXPECT_NEAR(led.error_px[i], i % 6 == 0 ? kOff_px : 0.0, kFitted_px) << i;
  }
}

TEST(FeatureImages, MustHaveOneSize) {
  EXPECT_THROW(match_features(FeatureMethod::orb, cv::Mat(10, 10, CV_8U), cv::Mat(10, 12, CV_8U)),
               Error);
}

}  // namespace
}  // namespace rugae
