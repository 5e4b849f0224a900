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

  const FeatureScore score = evaluate_feature(GetParam(), first, second, 1);
  ASSERT_TRUE(score.homography_found);
  EXPECT_EQ(score.matches, static_cast<int>(errors.size()));
  EXPECT_GE(score.inliers, 30);
  EXPECT_TRUE(score.median_error_px <= 1.0) << score.median_error_px;
  const FeatureScore again = evaluate_feature(GetParam(), first, second, 1);
  EXPECT_EQ(score.mean_error_px, again.mean_error_px);
}

TEST_P(Features, BlankImagesGiveNoHomography) {
  const cv::Mat gray(kHeight, kWidth, CV_8U, cv::Scalar(100));
  const FeatureScore score = evaluate_feature(GetParam(), gray, gray, 1);
  EXPECT_FALSE(score.homography_found);
  EXPECT_EQ(score.inliers, 0);
}

INSTANTIATE_TEST_SUITE_P(All, Features, ::testing::ValuesIn(kFeatureMethods), [](const auto& info) {
  std::string name = name_of(info.param);
  std::erase(name, '-');
  return name;
});

TEST(FeatureImages, MustHaveOneSize) {
  EXPECT_THROW(match_features(FeatureMethod::orb, cv::Mat(10, 10, CV_8U), cv::Mat(10, 12, CV_8U)),
               Error);
}

}  // namespace
}  // namespace rugae
