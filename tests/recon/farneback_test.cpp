// Our Farneback against OpenCV's, whose flow it is up to rounding.

#include "recon/farneback.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;
using testing::to_8bit;

cv::Mat picture(cv::Size size, const Vec2& shift) {
  const Texture texture(2, 7.0, 60.0);
  return to_8bit(draw(size.width, size.height, [&](const Vec2& p) {
    return texture(p + shift + 0.02 * Vec2(p.y(), -p.x()));
  }));
}

// Sizes that are whole numbers of four pixels on each level and sizes that are not.
class Farneback : public ::testing::TestWithParam<cv::Size> {};

TEST_P(Farneback, IsThatOfOpenCv) {
  const cv::Size size = GetParam();
  const cv::Mat first = picture(size, {0.0, 0.0}), second = picture(size, {3.7, -2.2});
  cv::Mat theirs(size, CV_32FC2, cv::Scalar(-2.0, 1.0));
  const cv::Mat ours =
      farneback(expand_polynomials(first), expand_polynomials(second), theirs.clone());
  cv::calcOpticalFlowFarneback(first, second, theirs, 0.5, 2, 21, 3, 7, 1.5,
                               cv::OPTFLOW_USE_INITIAL_FLOW);
  // Sums in another order, in single precision; where the texture is weak they weigh more.
  constexpr double kMedianPx = 1e-4, kWorstPx = 0.02;
  std::vector<double> differences;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      differences.push_back(cv::norm(ours.at<cv::Vec2f>(y, x) - theirs.at<cv::Vec2f>(y, x)));
  std::ranges::sort(differences);
  EXPECT_TRUE(differences[differences.size() / 2] <= kMedianPx)
      << differences[differences.size() / 2];
  EXPECT_TRUE(differences.back() <= kWorstPx) << differences.back();
  // And both found the motion: a pixel's wall goes to where the texture's place is the same.
  const cv::Vec2f middle = ours.at<cv::Vec2f>(size.height / 2, size.width / 2);
  EXPECT_TRUE(cv::norm(middle - cv::Vec2f(-3.7F, 2.2F)) <= 0.2) << middle;
}

INSTANTIATE_TEST_SUITE_P(Sizes, Farneback,
                         ::testing::Values(cv::Size(320, 240), cv::Size(250, 250),
                                           cv::Size(201, 67), cv::Size(45, 50)));

TEST(PolynomialPyramid, AreThoseOfAQuadraticPicture) {
  // f = 30 + 0.5 x + 0.002 x^2: around x the slope is 0.5 + 0.004 x, the curvature 0.002.
  cv::Mat image(64, 128, CV_8U);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<unsigned char>(y, x) =
          cv::saturate_cast<unsigned char>(30.0 + 0.5 * x + 0.002 * x * x);
  const PolynomialPyramid pyramid = expand_polynomials(image);
  const cv::Vec4f terms = pyramid[0].terms.at<cv::Vec4f>(32, 64);
  EXPECT_NEAR(terms[1], 0.5 + 0.004 * 64, 0.05);  // 8-bit steps
  EXPECT_NEAR(terms[0], 0.0, 1e-5);
  EXPECT_NEAR(terms[2], 0.0, 1e-4);
  EXPECT_NEAR(pyramid[0].mixed.at<float>(32, 64), 0.0, 1e-5);
}

}  // namespace
}  // namespace rugae
