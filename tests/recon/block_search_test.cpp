// Against OpenCV's normalised correlation.

#include "recon/block_search.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;
using testing::to_8bit;

cv::Mat picture(const Vec2& shift) {
  const Texture texture(2, 4.0, 60.0);
  return to_8bit(draw(80, 61, [&](const Vec2& p) { return texture(p + shift); }));
}

TEST(BlockSearch, IsTheCorrelationOfOpenCv) {
  const cv::Mat from = picture({0.0, 0.0}), to = picture({3.0, -2.0});
  for (const int side : {9, 20, BlockSearch::kMostSide})
    for (const int reach : {0, 5, 20}) {
      cv::Mat wide;
      cv::copyMakeBorder(to, wide, reach, reach, reach, reach, cv::BORDER_CONSTANT,
                         cv::Scalar(128));
      const BlockSearch search(to, side, reach);
      for (const cv::Point corner :
           {cv::Point(0, 0), cv::Point(17, 11), cv::Point(80 - side, 61 - side)}) {
        const cv::Rect block(corner, cv::Size(side, side));
        cv::Mat theirs;
        cv::matchTemplate(wide(cv::Rect(corner, cv::Size(side + 2 * reach, side + 2 * reach))),
                          from(block), theirs, cv::TM_CCOEFF_NORMED);
        const cv::Mat ours = search(from, corner);
        // OpenCV's goes through Fourier transforms in single precision.
        constexpr double kRounding = 1e-3;
        ASSERT_EQ(ours.size(), theirs.size());
        for (int y = 0; y < ours.rows; ++y)
          for (int x = 0; x < ours.cols; ++x) {
            cv::Scalar mean, deviation;
            cv::meanStdDev(wide(cv::Rect(corner.x + x, corner.y + y, side, side)), mean, deviation);
            // Where nothing is, ours is 0 and theirs what rounding makes of 0 / 0.
            if (deviation[0] <= 0.5)
              EXPECT_EQ(ours.at<float>(y, x), 0.0F);
            else
              EXPECT_NEAR(ours.at<float>(y, x), theirs.at<float>(y, x), kRounding)
                  << side << ", " << reach << ": " << x << ", " << y;
          }
      }
    }
}

TEST(BlockSearch, FindsTheMotion) {
  const BlockSearch search(picture({3.0, -2.0}), 20, 10);
  cv::Point best;
  cv::minMaxLoc(search(picture({0.0, 0.0}), {30, 20}), nullptr, nullptr, nullptr, &best);
  EXPECT_EQ(best - cv::Point(10, 10), cv::Point(-3, 2));
}

TEST(BlockSearch, AFlatBlockCorrelatesWithNothing) {
  const BlockSearch search(picture({0.0, 0.0}), 20, 10);
  const cv::Mat flat(61, 80, CV_8U, cv::Scalar(90));
  EXPECT_EQ(cv::countNonZero(search(flat, {30, 20})), 0);
}

TEST(BlockSearch, BlocksMustLieInThePictures) {
  const BlockSearch search(picture({0.0, 0.0}), 20, 10);
  EXPECT_THROW(search(picture({0.0, 0.0}), {61, 0}), Error);
  EXPECT_THROW(search(picture({0.0, 0.0}), {0, 42}), Error);
  EXPECT_THROW(search(cv::Mat::zeros(60, 80, CV_8U), {0, 0}), Error);  // of another size
  EXPECT_THROW(BlockSearch(picture({0.0, 0.0}), BlockSearch::kMostSide + 1, 10), Error);
}

}  // namespace
}  // namespace rugae
