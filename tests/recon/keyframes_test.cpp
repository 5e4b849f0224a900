#include "recon/keyframes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "image_sequence.h"
#include "recon/options.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

using testing::draw;
using testing::Texture;
using testing::to_8bit;

using Sequence = testing::ImageSequence;

Keyframes select_keyframes(const FrameSource& frames, const KeyframeOptions& options) {
  KeyframeSelector selector(frames, options);
  selector.advance(frames.size());
  return selector.keyframes();
}

TEST_F(Sequence, AKeyFrameIsTakenWhereTheMeanFlowReachesTheThreshold) {
  // 30 px at 640 px width are 15 px here: four steps of 4 px.
  const FrameSource frames = source(std::vector<double>(12, 4.0), plain());
  const Keyframes keys = select_keyframes(frames, {});
  EXPECT_EQ(keys.frames, (std::vector<int>{0, 4, 8, 12}));
  ASSERT_EQ(keys.mean_flow_px.size(), 4u);
  EXPECT_EQ(keys.mean_flow_px[0], 0.0);
  // The wall that enters at the border has no counterpart; elsewhere the flow is 16 px.
  for (int i = 1; i < 4; ++i)
    EXPECT_NEAR(keys.mean_flow_px[static_cast<std::size_t>(i)], 16.0, 0.8);
}

TEST_F(Sequence, AfterTheGapTheFrameFurthestAwayIsTaken) {
  // Out by 10 px, and back: never 15 px from the first. Frame 2 is the furthest of the first five.
  const FrameSource frames = source({5, 5, -3, -3, -2, 0, 0, 0, 0, 0}, plain());
  KeyframeOptions options;
  options.max_gap = 5;
  const Keyframes keys = select_keyframes(frames, options);
  ASSERT_GE(keys.frames.size(), 3u);
  EXPECT_EQ(keys.frames[1], 2);
  EXPECT_NEAR(keys.mean_flow_px[1], 10.0, 0.8);
  // Compared again with frame 2, frames 3 to 7 are 3, 6, 8, 8, 8 px away: the first of the largest,
  // up to the flow's noise.
  EXPECT_GE(keys.frames[2], 5);
  EXPECT_NEAR(keys.mean_flow_px[2], 8.0, 0.8);
}

TEST_F(Sequence, TheSameForAnyNumberOfThreads) {
  const FrameSource frames = source({3, 9, 2, 7, 7, 1, 12, 3, 3}, plain());
  const Keyframes many = select_keyframes(frames, {});
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Keyframes single = select_keyframes(frames, {});
  cv::setNumThreads(threads);
  EXPECT_EQ(many.frames, single.frames);
  EXPECT_EQ(many.mean_flow_px, single.mean_flow_px);
}

TEST_F(Sequence, FramesAreWhatTheStagesMake) {
  PreprocessOptions options = plain();
  options.reflections.suppress_for_map = false;
  const FrameSource frames = source({4, 4}, options);
  EXPECT_EQ(frames.size(), 3);
  EXPECT_TRUE(frames.vignetting_profile().empty());
  const Frame frame = frames.frame(1);
  EXPECT_EQ(frame.index, 1);
  EXPECT_EQ(frame.gray.type(), CV_8U);
  EXPECT_EQ(frame.map_bgr.type(), CV_8UC3);
  EXPECT_EQ(cv::countNonZero(frame.valid), Sequence::kWidth * Sequence::kHeight);
  EXPECT_EQ(cv::norm(frame.gray, frames.gray(1), cv::NORM_INF), 0.0);
  // A lens without distortion: undistortion is the identity.
  const cv::Mat original = frames.observations().image(1);
  EXPECT_EQ(cv::norm(frame.map_bgr, original, cv::NORM_INF), 0.0);
}

TEST_F(Sequence, VignettingIsEstimatedOnce) {
  const FrameSource frames = source({4, 4}, PreprocessOptions());
  ASSERT_EQ(frames.vignetting_profile().size(), 257u);
  EXPECT_NEAR(frames.vignetting_profile().front(), 1.0, 1e-12);
  EXPECT_EQ(cv::norm(frames.gray(2), frames.frame(2).gray, cv::NORM_INF), 0.0);
}

TEST_F(Sequence, PartsOfAFrameAreThoseOfTheWhole) {
  const FrameSource frames = source({4, 4}, PreprocessOptions());
  const Frame whole = frames.frame(1), pose = frames.pose_frame(1), map = frames.map_frame(1);
  EXPECT_EQ(cv::norm(pose.gray, whole.gray, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(pose.reflection, whole.reflection, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(map.map_bgr, whole.map_bgr, cv::NORM_INF), 0.0);
  EXPECT_TRUE(pose.map_bgr.empty() && map.gray.empty());
}

TEST(Flow, FollowsTheWallNotTheLight) {
  // The wall moves by 24 px under a spot of light that stands still.
  const Texture texture(2, 7.0, 60.0);
  const auto picture = [&](double shift) {
    return to_8bit(draw(Sequence::kWidth, Sequence::kHeight, [&](const Vec2& p) {
      const double light = std::exp(-(p - Vec2(160, 120)).squaredNorm() / (2.0 * 60.0 * 60.0));
      return (0.1 + 0.9 * light) * texture(p + Vec2(shift, 0.0));
    }));
  };
  const cv::Mat flow = farneback_flow(picture(0.0), picture(24.0));
  std::vector<double> errors;
  for (int y = 20; y < Sequence::kHeight - 20; y += 5)
    for (int x = 50; x < Sequence::kWidth - 50; x += 5)
      errors.push_back(cv::norm(flow.at<cv::Vec2f>(y, x) - cv::Vec2f(-24.0F, 0.0F)));
  std::sort(errors.begin(), errors.end());
  EXPECT_TRUE(errors[errors.size() / 2] <= 0.3) << errors[errors.size() / 2];
  EXPECT_TRUE(errors[errors.size() * 9 / 10] <= 1.0) << errors[errors.size() * 9 / 10];
}

}  // namespace
}  // namespace rugae
