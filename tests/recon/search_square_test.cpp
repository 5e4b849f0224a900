// Where a square lies in a picture is known, for it was cut from there; and what its correlation is
// anywhere another implementation tells.

#include "recon/dense/search_square.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "synthetic_texture.h"

namespace rugae {
namespace {

constexpr int kWidth = 160, kHeight = 120;

cv::Mat picture(int seed) {
  return testing::to_8bit(testing::draw(kWidth, kHeight, testing::Texture(seed, 9.0, 60.0)));
}

SearchSquare cut(const cv::Mat& from, int centre_x, int centre_y) {
  SearchSquare square;
  std::size_t i = 0;
  for (int y = -kSearchHalfPx; y <= kSearchHalfPx; ++y)
    for (int x = -kSearchHalfPx; x <= kSearchHalfPx; ++x, ++i)
      square[i] = from.at<unsigned char>(centre_y + y, centre_x + x);
  return square;
}

cv::Mat as_picture(const SearchSquare& square) {
  return cv::Mat(kSearchSidePx, kSearchSidePx, CV_32F, const_cast<float*>(square.data()));
}

// Windows of every width up to some, so that the last four places are cut off in every way; at each
// place the highest correlation and where it is are those of OpenCV, by Fourier transforms.
TEST(SearchSquare, FindsWhatOpenCvFinds) {
  constexpr double kRounding = 1e-4;  // of OpenCV's transforms, in single precision
  const cv::Mat in = picture(1);
  cv::Mat floats;
  in.convertTo(floats, CV_32F);
  for (int side = kSearchSidePx; side < 30; ++side) {
    const cv::Rect window(40 + side, 70 - side, side, side + 3);
    const SearchSquare square = cut(picture(2), 30 + side, 50);  // of another picture
    cv::Mat scores;
    cv::matchTemplate(floats(window), as_picture(square), scores, cv::TM_CCOEFF_NORMED);
    double best = 0.0;
    cv::Point at;
    cv::minMaxLoc(scores, nullptr, &best, nullptr, &at);
    const auto hit = search_square(square, in, window);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->correlation, best, kRounding) << side;
    const Vec2 whole(window.x + at.x + kSearchHalfPx + 0.5, window.y + at.y + kSearchHalfPx + 0.5);
    EXPECT_TRUE((hit->centre_px - whole).cwiseAbs().maxCoeff() <= 1.0) << side;
  }
}

// The square comes from between the pixels, with another gain. Whole pixels would be 0.41 px off
// (root mean square of both directions); the parabola through 3 x 3 takes off near half of it.
TEST(SearchSquare, FindsAPlaceBetweenPixels) {
  constexpr double kPlacePx = 0.25;
  const testing::Texture texture(3, 9.0, 60.0);
  const cv::Mat in = testing::to_8bit(testing::draw(kWidth, kHeight, texture));
  double square_sum = 0.0;
  int count = 0;
  for (int tenths = -4; tenths <= 5; ++tenths) {
    const Vec2 shift(0.1 * tenths, -0.1 * tenths);
    const cv::Mat shifted =
        testing::draw(kWidth, kHeight, [&](const Vec2& p) { return texture(Vec2(p + shift)); });
    const cv::Mat darker = testing::to_8bit(shifted * 0.7 + 0.05);
    for (int x = 20; x < kWidth - 20; x += 23, ++count) {
      const auto hit = search_square(cut(darker, x, 60), in, {x - 10, 50, 21, 21});
      ASSERT_TRUE(hit);
      EXPECT_TRUE(hit->correlation > 0.95) << x;
      square_sum += (hit->centre_px - Vec2(x + 0.5, 60.5) - shift).squaredNorm();
    }
  }
  EXPECT_TRUE(std::sqrt(square_sum / count) <= kPlacePx) << std::sqrt(square_sum / count);
}

TEST(SearchSquare, WhatIsFlatIsFoundNowhereAndFindsNothing) {
  const cv::Mat in = picture(4);
  SearchSquare flat;
  flat.fill(90.0F);
  EXPECT_FALSE(search_square(flat, in, {20, 20, 21, 21}));
  const auto nowhere =
      search_square(cut(in, 40, 40), cv::Mat(kHeight, kWidth, CV_8U, 128), {20, 20, 21, 21});
  ASSERT_TRUE(nowhere);
  EXPECT_EQ(nowhere->correlation, 0.0);
}

TEST(SearchSquare, StaysInThePicture) {
  const cv::Mat in = picture(5);
  EXPECT_FALSE(
      search_square(cut(in, 40, 40), in, {-15, 20, 21, 21}));  // six columns of it are left
  EXPECT_FALSE(search_square(cut(in, 40, 40), in, {300, 20, 21, 21}));
  const auto corner = search_square(cut(in, kSearchHalfPx, kSearchHalfPx), in, {-10, -10, 21, 21});
  ASSERT_TRUE(corner);
  EXPECT_TRUE((corner->centre_px - Vec2(kSearchHalfPx + 0.5, kSearchHalfPx + 0.5)).norm() < 1e-9);
}

}  // namespace
}  // namespace rugae
