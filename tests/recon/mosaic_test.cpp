#include "recon/mosaic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/files.h"
#include "core/random.h"
#include "core/units.h"
#include "recon/blend.h"
#include "recon/mosaic_plan.h"

namespace rugae {
namespace {

Lens test_lens() {
  Lens lens;
  lens.width = 160;
  lens.height = 120;
  lens.fx = lens.fy = 110.0;
  lens.cx = 80.0;
  lens.cy = 60.0;
  return lens;
}

Quat pan(double angle_rad) { return Quat(Eigen::AngleAxisd(angle_rad, Vec3::UnitY())); }

/// A camera that turns about its centre: pixels of two views are related by K R K^-1 exactly.
struct Turning {
  Structure structure;
  std::vector<PairAlignment> pairs;
};

Turning turning_camera(const std::vector<double>& angles_rad, const Lens& lens) {
  Turning turning;
  const Mat3 k = lens.matrix();
  for (std::size_t i = 0; i < angles_rad.size(); ++i) {
    turning.structure.frames.push_back(static_cast<int>(10 * i));  // frame index, not position
    turning.structure.placed.push_back(true);
    turning.structure.cam_from_world.emplace_back(pan(angles_rad[i]).conjugate(), Vec3::Zero());
    if (i == 0) continue;
    PairAlignment pair;
    pair.reference = static_cast<int>(10 * (i - 1));
    pair.moving = static_cast<int>(10 * i);
    pair.inliers = 100;
    pair.ref_from_mov_homography =
        k * pan(angles_rad[i] - angles_rad[i - 1]).toRotationMatrix() * k.inverse();
    turning.pairs.push_back(pair);
  }
  return turning;
}

/// Smooth blobs on a plane, so that interpolation is nearly exact; grey in [40, 220].
double texture(const Vec2& p) {
  return 130.0 + 45.0 * std::sin(0.11 * p.x() + 0.05 * p.y()) +
         45.0 * std::cos(0.07 * p.y() - 0.08 * p.x());
}

BlendInput picture_of(const Mat3& plane_from_image, cv::Size size, double gain = 1.0) {
  BlendInput input{cv::Mat(size, CV_8UC3), cv::Mat(size, CV_8U, cv::Scalar(255)), plane_from_image};
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const Vec2 on_plane = (plane_from_image * Vec3(x + 0.5, y + 0.5, 1.0)).hnormalized();
      input.bgr.at<cv::Vec3b>(y, x) =
          cv::Vec3b::all(cv::saturate_cast<uchar>(gain * texture(on_plane)));
    }
  return input;
}

Mat3 homography(double dx, double dy, double turn_rad) {
  Mat3 h = Mat3::Identity();
  h.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(turn_rad).toRotationMatrix();
  h.topRightCorner<2, 1>() = Vec2(dx, dy);
  h(2, 0) = 2e-4;
  return h;
}

const Eigen::AlignedBox2d kWide(Vec2(-500, -500), Vec2(800, 800));

// --- Which frames form a mosaic ----------------------------------------------------------------

TEST(MosaicPlan, EveryPlacedKeyFrameIsCoveredByFewMosaics) {
  const Lens lens = test_lens();
  std::vector<double> angles;
  for (int i = 0; i < 24; ++i) angles.push_back(rad_from_deg(6.0 * i));
  const Turning turning = turning_camera(angles, lens);
  const auto plans = plan_mosaics(turning.structure, turning.pairs, lens, MosaicOptions{});
  std::set<int> covered;
  for (const MosaicPlan& plan : plans) {
    EXPECT_EQ(plan.members.front().keyframe, plan.anchor);
    for (const MosaicMember& member : plan.members) {
      covered.insert(member.keyframe);
      const double angle = std::abs(angles[member.keyframe] - angles[plan.anchor]);
      EXPECT_LE(angle, MosaicOptions{}.max_view_angle_rad);
    }
  }
  EXPECT_EQ(covered.size(), angles.size());
  EXPECT_LE(plans.size(), 8u);  // three or more frames each
}

TEST(MosaicPlan, ChainedHomographiesAreThoseOfTheTurn) {
  const Lens lens = test_lens();
  const std::vector<double> angles = {0.0, 0.1, 0.2, 0.3};
  const Turning turning = turning_camera(angles, lens);
  const auto plans = plan_mosaics(turning.structure, turning.pairs, lens, MosaicOptions{});
  ASSERT_FALSE(plans.empty());
  const Mat3 k = lens.matrix();
  for (const MosaicPlan& plan : plans)
    for (const MosaicMember& member : plan.members) {
      const Mat3 expected =
          k * pan(angles[member.keyframe] - angles[plan.anchor]).toRotationMatrix() * k.inverse();
      const Vec3 corner(3.0, 100.0, 1.0);
      const Vec2 error =
          (member.anchor_from_member * corner).hnormalized() - (expected * corner).hnormalized();
      EXPECT_LE(error.norm(), 1e-9) << member.keyframe;
    }
}

TEST(MosaicPlan, PointsOfTheBundleAdjustmentReplaceADriftingChain) {
  const Lens lens = test_lens();
  const std::vector<double> angles = {0.0, 0.1};
  Turning turning = turning_camera(angles, lens);
  turning.pairs[0].ref_from_mov_homography(0, 2) += 7.0;  // px of drift
  const Structure& s = turning.structure;
  for (int i = 0; i < 60; ++i) {
    const auto u = random_uniform(1, Purpose::test, 3, i);
    Track track;
    track.point = Vec3(-8 + 30 * u[0], -10 + 20 * u[1], 30.0 + 10 * u[2]);
    track.triangulated = true;
    for (int k = 0; k < 2; ++k)
      if (const auto pixel = lens.project(s.cam_from_world[k] * track.point);
          pixel && lens.contains(*pixel))
        track.observations.push_back({k, *pixel});
    if (!track.observations.empty()) turning.structure.tracks.push_back(track);
  }
  const auto plans = plan_mosaics(turning.structure, turning.pairs, lens, MosaicOptions{});
  ASSERT_EQ(plans.size(), 1u);
  ASSERT_EQ(plans[0].members.size(), 2u);
  const MosaicMember& member = plans[0].members[1];
  const Mat3 k = lens.matrix();
  const Mat3 expected =
      k * pan(angles[member.keyframe] - angles[plans[0].anchor]).toRotationMatrix() * k.inverse();
  const Vec3 centre(80.0, 60.0, 1.0);
  EXPECT_LE(((member.anchor_from_member * centre).hnormalized() - (expected * centre).hnormalized())
                .norm(),
            1e-6);
}

TEST(MosaicPlan, LostKeyFramesAndDegenerateHomographiesStayOut) {
  const Lens lens = test_lens();
  Turning turning = turning_camera({0.0, 0.05, 0.1, 0.15}, lens);
  turning.structure.placed[1] = false;
  turning.pairs[2].ref_from_mov_homography(0, 0) *= -1.0;  // 3 on 2, mirrored
  const auto plans = plan_mosaics(turning.structure, turning.pairs, lens, MosaicOptions{});
  std::set<int> covered;
  for (const MosaicPlan& plan : plans) {
    EXPECT_EQ(plan.members.size(), 1u);  // the chain is cut at 1 and at 3
    for (const MosaicMember& member : plan.members) covered.insert(member.keyframe);
  }
  EXPECT_EQ(covered, (std::set<int>{0, 2, 3}));
}

TEST(MosaicPlan, DegenerateOutlines) {
  const Lens lens = test_lens();
  EXPECT_TRUE(outline_on_anchor(Mat3::Identity(), lens));
  Mat3 h = Mat3::Identity();
  h(0, 0) = -1.0;
  EXPECT_FALSE(outline_on_anchor(h, lens)) << "mirrored";
  h = Mat3::Identity();
  h(2, 0) = -1.0 / 100.0;
  EXPECT_FALSE(outline_on_anchor(h, lens)) << "line at infinity inside the frame";
  h = Vec3(0.2, 0.2, 1.0).asDiagonal();
  EXPECT_FALSE(outline_on_anchor(h, lens)) << "a 25th of the area";
  h = Vec3(1.0, 0.2, 1.0).asDiagonal();
  EXPECT_FALSE(outline_on_anchor(h, lens)) << "squeezed";
  h = Mat3::Identity();
  h(0, 2) = 150.0;
  EXPECT_FALSE(outline_on_anchor(h, lens)) << "off the canvas";
  h(0, 2) = std::nan("");
  EXPECT_FALSE(outline_on_anchor(h, lens)) << "not a number";
}

// --- One picture -------------------------------------------------------------------------------

TEST(Blend, PicturesOfOnePlaneGiveThatPlane) {
  const cv::Size size(160, 120);
  const std::vector<BlendInput> inputs = {picture_of(Mat3::Identity(), size),
                                          picture_of(homography(70.3, 12.6, 0.1), size),
                                          picture_of(homography(-60.8, 30.2, -0.2), size)};
  const BlendResult result = blend(inputs, kWide, 5);
  ASSERT_EQ(result.bgr.size(), result.valid.size());
  std::vector<double> errors;
  for (int y = 0; y < result.bgr.rows; ++y)
    for (int x = 0; x < result.bgr.cols; ++x) {
      if (result.valid.at<uchar>(y, x) == 0) {
        EXPECT_EQ(result.seams.at<int>(y, x), -1);
        continue;
      }
      EXPECT_GE(result.seams.at<int>(y, x), 0);
      const Vec2 on_plane = Vec2(x + 0.5, y + 0.5) + result.origin_px;
      errors.push_back(std::abs(result.bgr.at<cv::Vec3b>(y, x)[0] - texture(on_plane)));
    }
  ASSERT_GE(errors.size(), 25000u);  // a third more than the anchor's frame alone
  std::sort(errors.begin(), errors.end());
  for (const double gain : result.gains) EXPECT_NEAR(gain, 1.0, 0.01);
  // Rounding to 8 bits twice, interpolation, and gains that stay within 1 % of one.
  EXPECT_LE(errors[errors.size() / 2], 1.5);
  EXPECT_LE(errors[errors.size() * 99 / 100], 6.0);
}

TEST(Blend, OriginTakesMosaicPixelsToTheAnchor) {
  const cv::Size size(160, 120);
  const BlendResult result =
      blend({picture_of(Mat3::Identity(), size), picture_of(homography(-40.0, -25.0, 0.0), size)},
            kWide, 3);
  EXPECT_LE(result.origin_px.x(), -39.0);
  EXPECT_LE(result.origin_px.y(), -24.0);
  // The middle of the anchor comes from the anchor.
  const Vec2 middle = Vec2(80.5, 60.5) - result.origin_px;
  EXPECT_EQ(result.seams.at<int>(static_cast<int>(middle.y()), static_cast<int>(middle.x())), 0);
}

TEST(Blend, GainsBringADarkerFrameUp) {
  const cv::Size size(160, 120);
  constexpr double kDarker = 0.8;
  const BlendResult result = blend(
      {picture_of(Mat3::Identity(), size), picture_of(homography(40.0, 0.0, 0.0), size, kDarker)},
      kWide, 5);
  // Brown and Lowe's prior (standard deviation 0.1 on gains, 10 grey levels on errors) keeps the
  // gains a little short of the full ratio.
  EXPECT_NEAR(result.gains[1] / result.gains[0], 1.0 / kDarker, 0.05);
}

TEST(Blend, CanvasStaysWithinItsBounds) {
  const cv::Size size(160, 120);
  const Eigen::AlignedBox2d bounds(Vec2(-20, -10), Vec2(180, 130));
  const BlendResult result =
      blend({picture_of(Mat3::Identity(), size), picture_of(homography(90.0, 60.0, 0.3), size)},
            bounds, 5);
  EXPECT_LE(result.bgr.cols, 200);
  EXPECT_LE(result.bgr.rows, 140);
}

TEST(Blend, ThreadsDoNotMatter) {
  const cv::Size size(160, 120);
  const std::vector<BlendInput> inputs = {picture_of(Mat3::Identity(), size),
                                          picture_of(homography(70.3, 12.6, 0.1), size, 0.9)};
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const BlendResult one = blend(inputs, kWide, 5);
  cv::setNumThreads(4);
  const BlendResult four = blend(inputs, kWide, 5);
  cv::setNumThreads(threads);
  EXPECT_EQ(cv::norm(one.bgr, four.bgr, cv::NORM_INF), 0.0);
}

// --- From files --------------------------------------------------------------------------------

TEST(Mosaic, FramesOfAFolderBecomeOneMosaic) {
  const Lens lens = test_lens();
  const auto folder = std::filesystem::temp_directory_path() / "rugae_mosaic_test";
  std::filesystem::remove_all(folder);
  make_folder(folder / "frames");
  const std::vector<double> angles = {0.0, 0.15, 0.3};
  Turning turning = turning_camera(angles, lens);
  turning.structure.frames = {0, 1, 2};
  for (std::size_t i = 0; i < turning.pairs.size(); ++i) {
    turning.pairs[i].reference = static_cast<int>(i);
    turning.pairs[i].moving = static_cast<int>(i + 1);
  }
  const Mat3 k = lens.matrix();
  for (int i = 0; i < 3; ++i) {
    const Mat3 middle_from_frame = k * pan(angles[i] - angles[1]).toRotationMatrix() * k.inverse();
    cv::imwrite((folder / "frames" / (std::to_string(i) + ".png")).string(),
                picture_of(middle_from_frame, {lens.width, lens.height}).bgr);
  }
  write_atomic(folder / "lens.yaml", lens_yaml(lens, "test"));
  PreprocessOptions plain;
  plain.undistort = plain.devignette = false;
  plain.reflections.suppress_for_map = false;
  const FrameSource frames(Observations::open(folder / "frames", folder / "lens.yaml"), plain);
  const auto plans = plan_mosaics(turning.structure, turning.pairs, frames.lens(), {});
  ASSERT_EQ(plans.size(), 1u);
  const Mosaic mosaic = compose_mosaic(frames, turning.structure, plans[0], {});
  EXPECT_EQ(mosaic.anchor, 1);
  EXPECT_EQ(mosaic.members.size(), 3u);
  EXPECT_GE(mosaic.bgr.cols, lens.width + 20);
  double error = 0.0;
  int count = 0;
  std::set<int> sources;
  for (int y = 0; y < mosaic.bgr.rows; ++y)
    for (int x = 0; x < mosaic.bgr.cols; ++x) {
      if (mosaic.valid.at<uchar>(y, x) == 0) continue;
      sources.insert(mosaic.seams.at<int>(y, x));
      error += std::abs(mosaic.bgr.at<cv::Vec3b>(y, x)[0] -
                        texture(Vec2(x + 0.5, y + 0.5) + mosaic.origin_px));
      ++count;
    }
  EXPECT_LE(error / count, 2.0);
  EXPECT_EQ(sources, (std::set<int>{0, 1, 2}));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace rugae
