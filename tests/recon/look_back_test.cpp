// Which earlier key frames are asked where a chain broke.

#include "recon/look_back.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "synthetic_texture.h"

namespace rugae {
namespace {

constexpr int kWidth = 320, kHeight = 240;

// Windows into one wall, and another wall.
class LookBackAt : public ::testing::Test {
 protected:
  static cv::Mat picture(int x, std::uint64_t wall = 4) {
    const cv::Mat all = testing::draw(2 * kWidth, kHeight, testing::Texture(wall, 12.0, 60.0));
    return testing::to_8bit(all(cv::Rect(x, 0, kWidth, kHeight))).clone();
  }
  static PairAlignment moved(int reference, int moving, double by_px) {
    PairAlignment pair;
    pair.reference = reference;
    pair.moving = moving;
    for (int i = 0; i < 20; ++i) {
      pair.reference_px.emplace_back(40.0 + 10.0 * i, 20.0 + 10.0 * i);
      pair.moving_px.push_back(pair.reference_px.back() + Vec2(by_px, 0.0));
    }
    return pair;
  }
  static double mean_x(const cv::Mat& flow) { return cv::mean(flow)[0]; }

  LookBack memory_{cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(255))};
};

TEST_F(LookBackAt, WhatLooksAlikeAfterItsShift) {
  memory_.add(0, picture(0));
  memory_.add(2, picture(0, 7));
  memory_.link(0, 2);
  memory_.add(9, picture(40));  // the wall of frame 0, 40 px to the left
  const auto found = memory_.candidates(9, 3);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].frame, 0);
  constexpr double kSmallPx = kWidth / 64.0;  // the pixel of the pictures that are compared
  EXPECT_NEAR(mean_x(found[0].flow), -40.0, kSmallPx);
}

TEST_F(LookBackAt, TheEndOfAChainComesFirstAndItsMotionGoesOn) {
  memory_.add(0, picture(0));
  memory_.add(2, picture(0, 7));
  memory_.link(0, 2);
  memory_.end(moved(0, 2, 6.0));
  memory_.add(5, picture(40));
  auto found = memory_.candidates(5, 3);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].frame, 2);
  EXPECT_NEAR(mean_x(found[0].flow), 9.0, 1e-4);  // 3 px a frame
  EXPECT_EQ(found[1].frame, 0);
  EXPECT_EQ(memory_.candidates(5, 1).size(), 1u);
  memory_.add(40, picture(40));  // too long after
  found = memory_.candidates(40, 1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].frame, 2);
}

// The larger group looks no further, whichever began first.
TEST_F(LookBackAt, WhatHangsTogetherWithMostIsNotAsked) {
  memory_.add(0, picture(0));
  EXPECT_TRUE(memory_.candidates(0, 3).empty());
  for (const int frame : {3, 4, 5}) memory_.add(frame, picture(0));
  EXPECT_FALSE(memory_.candidates(5, 3).empty());
  memory_.link(3, 4);
  memory_.link(4, 5);
  EXPECT_TRUE(memory_.candidates(5, 3).empty());
  memory_.add(6, picture(0));
  memory_.link(0, 6);
  EXPECT_FALSE(memory_.candidates(6, 3).empty());
  memory_.link(0, 5);
  EXPECT_TRUE(memory_.candidates(6, 3).empty());
}

}  // namespace
}  // namespace rugae
