// A camera that moves while its rows are read, against the row poses of the simulation, which know
// nothing of this.

#include "recon/rolling_shutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "cameras/row_poses.h"
#include "recon/map.h"

namespace rugae {
namespace {

constexpr double kRowTime_s = 90e-6;

Lens barrel() {
  Lens lens;
  lens.width = lens.height = 250;
  lens.fx = lens.fy = 150.0;
  lens.cx = lens.cy = 125.0;
  lens.k1 = -0.2;
  lens.k2 = 0.03;
  return lens;
}

// 300 degrees and 150 mm a second: 12 degrees and 6 mm over a readout's 40 ms at twice this size.
CameraMotion fast() { return {{1.5, -4.0, 2.5}, {80.0, -50.0, 110.0}}; }

Rigid3 some_pose() {
  return {Quat(Eigen::AngleAxisd(0.8, Vec3(1.0, 2.0, -0.5).normalized())), Vec3(3.0, -4.0, 5.0)};
}

// Poses of the rows of a camera at some_pose() that moves so.
RowPoses rows_of(const CameraMotion& motion, const Lens& lens) {
  std::vector<Rigid3> poses;
  for (int row = -1; row <= lens.height; ++row)
    poses.push_back(
        (motion.after((row + 0.5 - 0.5 * lens.height) * kRowTime_s) * some_pose()).inverse());
  return {std::move(poses), kRowTime_s};
}

TEST(RollingShutter, PointsLandWhereRowPosesPutThem) {
  const Lens lens = barrel();
  const RowPoses rows = rows_of(fast(), lens);
  const RollingShutter shutter(lens.pinhole(), lens, kRowTime_s);
  const LensProjector original(lens), straight(lens.pinhole());
  // Between rows the simulation's poses are straight lines.
  constexpr double kStraightPx = 1e-4;
  double most_moved = 0.0;
  int seen = 0;
  for (double z : {8.0, 30.0, 90.0})
    for (double x = -0.7; x <= 0.7; x += 0.2)
      for (double y = -0.7; y <= 0.7; y += 0.2) {
        const Vec3 p_cam = z * Vec3(x, y, 1.0), p_world = some_pose().inverse() * p_cam;
        const auto landed = rows.landing(
            original, [&](double) { return p_world; }, 0.5 * lens.height);
        if (!landed || !lens.contains(*landed)) continue;
        ++seen;
        const auto at_row = shutter.when_seen(p_cam, fast());
        ASSERT_TRUE(at_row.has_value());
        const Vec2 found = *shutter.project_original(*at_row);
        EXPECT_LE((found - *landed).norm(), kStraightPx);
        EXPECT_LE((*shutter.project(p_cam, fast()) - *straight.project(*at_row)).norm(), 1e-9);
        most_moved = std::max(most_moved, (*original.project(p_cam) - *landed).norm());

        const Vec2 ray = at_row->head<2>() / at_row->z();
        EXPECT_LE((shutter.ray_at_frame_time(ray, z, fast()) - Vec2(x, y)).norm(), 1e-6);
      }
  EXPECT_GE(seen, 60);
  EXPECT_GE(most_moved, 10.0);  // px: the test has something to see
}

TEST(RollingShutter, AGlobalOneSeesAllAtOnce) {
  const Lens lens = barrel();
  const RollingShutter shutter(lens.pinhole(), lens, 0.0);
  const Vec3 p_cam(3.0, -7.0, 20.0);
  EXPECT_FALSE(shutter.rolling());
  EXPECT_EQ(shutter.offset_s(p_cam), 0.0);
  EXPECT_EQ(*shutter.when_seen(p_cam, fast()), p_cam);
  EXPECT_EQ(*shutter.project(p_cam, fast()), *lens.pinhole().project(p_cam));
  EXPECT_EQ(shutter.ray_at_frame_time({0.3, 0.1}, 20.0, fast()), Vec2(0.3, 0.1));
}

TEST(RollingShutter, WhatIsBehindIsNotSeen) {
  const RollingShutter shutter(barrel().pinhole(), barrel(), kRowTime_s);
  EXPECT_FALSE(shutter.project({0.0, 0.0, -5.0}, fast()).has_value());
  EXPECT_FALSE(shutter.project({0.0, 0.0, NAN}, fast()).has_value());
}

// A wall that comes nearer while the rows are read: each has the depth of its own time.
TEST(RollingShutter, DepthIsThatOfThePixelsRow) {
  const Lens lens = barrel();
  const RollingShutter shutter(lens.pinhole(), lens, kRowTime_s);
  TriangleMesh wall;
  constexpr double kFar = 20.0, kSpeed = -100.0;
  constexpr int kCells = 40;  // a triangle is flat only at one time
  for (int y = 0; y <= kCells; ++y)
    for (int x = 0; x <= kCells; ++x)
      wall.vertices.emplace_back(80.0 * x / kCells - 40.0, 80.0 * y / kCells - 40.0, kFar);
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      const int a = y * (kCells + 1) + x, b = a + kCells + 1;
      wall.triangles.push_back({a, a + 1, b});
      wall.triangles.push_back({b, a + 1, b + 1});
    }
  const CameraMotion nearer{Vec3::Zero(), Vec3(0.0, 0.0, kSpeed)};
  const cv::Mat depth = keyframe_depth(wall, {Rigid3{}, nearer}, shutter, pixel_rays(lens));
  constexpr double kBentMm = 0.02;  // between a triangle's corners
  for (int y = 5; y < lens.height; y += 40) {
    const double then = kFar + kSpeed * (y + 0.5 - 0.5 * lens.height) * kRowTime_s;
    EXPECT_NEAR(depth.at<float>(y, 125), then, kBentMm) << y;
  }
  EXPECT_GE(std::abs(kSpeed * lens.height * kRowTime_s), 50.0 * kBentMm);
}

constexpr double kRounding = 1e-12;

// A speed that grows, poses at unequal times and some missing: the parabola is exact.
TEST(CameraMotions, OfASpeedThatGrows) {
  const Vec3 speed(1.0, -2.0, 0.5), growth(0.3, 0.2, -0.7);
  const std::vector<double> times_s = {0.0, 0.1, 0.3, 0.35, 0.6};
  std::vector<std::optional<Rigid3>> poses;
  for (const double t : times_s)
    poses.emplace_back(Rigid3(Quat::Identity(), speed * t + growth * t * t));
  poses[2].reset();
  const std::vector<CameraMotion> motions = motions_of(poses, times_s);
  ASSERT_EQ(motions.size(), 5u);
  for (const int k : {0, 1, 3, 4}) {
    EXPECT_LE((motions[k].shift_per_s - (speed + 2.0 * growth * times_s[k])).norm(), kRounding);
    EXPECT_LE(motions[k].turn_rad_per_s.norm(), kRounding);
  }
  EXPECT_EQ(motions[2].shift_per_s, Vec3::Zero());
  // Of two poses the straight line: the speed in the middle of the step.
  poses[1].reset();
  poses[4].reset();
  const std::vector<CameraMotion> of_two = motions_of(poses, times_s);
  for (const int k : {0, 3})
    EXPECT_LE((of_two[k].shift_per_s - (speed + growth * 0.35)).norm(), kRounding);
}

// Steady motion in the camera's own axes is its own answer, and a world that is moved and scaled
// changes nothing but the length of the shift.
TEST(CameraMotions, OfASteadyTurn) {
  const CameraMotion steady{{0.5, -1.0, 0.8}, Vec3::Zero()};
  std::vector<std::optional<Rigid3>> poses;
  const std::vector<double> times_s = {-0.1, 0.0, 0.2};
  for (const double t : times_s) poses.emplace_back(steady.after(t) * some_pose());
  for (const CameraMotion& motion : motions_of(poses, times_s))
    EXPECT_LE((motion.turn_rad_per_s - steady.turn_rad_per_s).norm(), kRounding);
}

TEST(CameraMotions, OneOrNoPoseIsRest) {
  const auto rest = [](const std::vector<CameraMotion>& motions) {
    for (const CameraMotion& motion : motions)
      EXPECT_TRUE(motion.turn_rad_per_s.isZero() && motion.shift_per_s.isZero());
    return motions.size();
  };
  EXPECT_EQ(rest(motions_of({}, {})), 0u);
  EXPECT_EQ(rest(motions_of({some_pose(), std::nullopt}, {0.0, 1.0})), 2u);
}

}  // namespace
}  // namespace rugae
