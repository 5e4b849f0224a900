#include "validate/labels_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/check.h"

namespace rugae {
namespace {

Lens pinhole() {
  Lens lens;
  lens.width = 80;
  lens.height = 60;
  lens.fx = lens.fy = 60.0;
  lens.cx = 40.0;
  lens.cy = 30.0;
  return lens;
}

// A wall at z = 20 mm; the camera then moves 1 mm to the right and 2 mm forward.
// A pixel at (u, v) from the centre moves to ((20 u / f - 1) f / 18, ...).
struct TwoFrames {
  Rigid3 now{}, next{Quat::Identity(), Vec3(1, 0, 2)};
  FrameTruth first, second;
  TwoFrames() {
    const Lens lens = pinhole();
    first.depth_mm = cv::Mat(60, 80, CV_32F, cv::Scalar(20));
    second.depth_mm = cv::Mat(60, 80, CV_32F, cv::Scalar(18));
    first.normal = cv::Mat(60, 80, CV_32FC3, cv::Scalar(0, 0, -1));
    first.masks = cv::Mat(60, 80, CV_8U, cv::Scalar(kMaskValid | kMaskFlowValid));
    first.flow_px = cv::Mat(60, 80, CV_32FC2);
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 80; ++x) {
        const double u = x + 0.5 - lens.cx, v = y + 0.5 - lens.cy;
        first.flow_px.at<cv::Vec2f>(y, x) =
            cv::Vec2f(static_cast<float>(u * 20 / 18 - lens.fx / 18 - u),
                      static_cast<float>(v * 20 / 18 - v));
      }
  }
};

constexpr double kSingle_px = 1e-4;  // flow is a 32-bit float of some pixels

TEST(LabelsCheck, ConsistentLabelsAgree) {
  const TwoFrames f;
  const LabelsCheck check = check_labels(pinhole(), f.now, f.next, f.first, f.second, 3);
  EXPECT_EQ(check.pixels, 20u * 27u);
  EXPECT_TRUE(check.flow_px.max <= kSingle_px) << check.flow_px.max;
  EXPECT_TRUE(check.depth_share.max <= 1e-6);
  EXPECT_TRUE(check.depth_share.count > 300u);
  EXPECT_EQ(check.unit_normals, check.pixels);
  EXPECT_EQ(check.facing_normals, check.pixels);
}

TEST(LabelsCheck, AWrongFlowPoseOrDepthShows) {
  TwoFrames flow;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) flow.first.flow_px.at<cv::Vec2f>(y, x) += cv::Vec2f(0.3f, 0.4f);
  EXPECT_NEAR(check_labels(pinhole(), flow.now, flow.next, flow.first, flow.second).flow_px.mean,
              0.5, kSingle_px);
  TwoFrames pose;  // 0.03 mm sideways at 18 mm: 0.1 px
  pose.next.translation.x() += 0.03;
  EXPECT_NEAR(check_labels(pinhole(), pose.now, pose.next, pose.first, pose.second).flow_px.mean,
              0.1, kSingle_px);
  TwoFrames depth;
  depth.second.depth_mm.setTo(17.1f);  // 5 % too near
  EXPECT_NEAR(
      check_labels(pinhole(), depth.now, depth.next, depth.first, depth.second).depth_share.mean,
      0.05, 1e-6);
}

TEST(LabelsCheck, MaskedPixelsAreLeftOutAndOccludedOnesNeedNoDepth) {
  TwoFrames f;
  f.first.masks.setTo(kMaskValid);
  EXPECT_EQ(check_labels(pinhole(), f.now, f.next, f.first, f.second).pixels, 0u);
  f.first.masks.setTo(kMaskValid | kMaskFlowValid | kMaskFlowOccluded);
  EXPECT_EQ(check_labels(pinhole(), f.now, f.next, f.first, f.second).depth_share.count, 0u);
}

TEST(LabelsCheck, AFlowThatIsNotFiniteFails) {
  TwoFrames f;
  f.first.flow_px.at<cv::Vec2f>(0, 0)[0] = std::numeric_limits<float>::quiet_NaN();
  const LabelsCheck check = check_labels(pinhole(), f.now, f.next, f.first, f.second);
  EXPECT_FALSE(check.flow_px.max <= kSingle_px);
}

TEST(LabelsCheck, AFrameWithoutFlowIsAnError) {
  TwoFrames f;
  f.first.flow_px = cv::Mat();
  EXPECT_THROW(check_labels(pinhole(), f.now, f.next, f.first, f.second), Error);
}

}  // namespace
}  // namespace rugae
