#include "trajectories/board_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.h"
#include "tests/message_of.h"
#include "trajectories/trajectory.h"

namespace rugae {
namespace {

constexpr int kViews = 30;
constexpr double kClearance_mm = 4.0;
// 10 x 8 squares of 2.5 mm and a border half as wide, the first inner corner at the origin.
const BoardOutline kBoard{Vec3(-3.75, -3.75, 0.0), Vec3(27.5, 0.0, 0.0), Vec3(0.0, 22.5, 0.0)};

Lens fisheye() {
  Lens lens;
  lens.model = LensModel::kannala_brandt;
  lens.width = lens.height = 512;
  lens.fx = lens.fy = 195.0;
  lens.cx = lens.cy = 256.0;
  lens.k1 = -0.02;
  lens.k2 = 0.003;
  lens.stop = {StopShape::circle, 1.0};
  return lens;
}

std::vector<Lens> lenses() {
  std::vector<Lens> list{fisheye()};
  for (const char* name : {"awaiba-naneye", "misumi-v3506", "misumi-v5506", "potensic-mini"})
    list.push_back(load_camera(name).lens);
  return list;
}

PoseTrack views(const Lens& lens, int count = kViews, std::uint64_t seed = 1) {
  return plan_board_views(lens, kBoard, load_trajectory("chessboard").board, kClearance_mm, count,
                          30.0, seed, "chessboard");
}

TEST(BoardViews, TheWholeBoardIsInEveryPicture) {
  for (const Lens& lens : lenses()) {
    for (const TimedPose& pose : views(lens)) {
      const Rigid3 cam_from_world = pose.world_from_camera.inverse();
      EXPECT_LT(pose.world_from_camera.translation.z(), 0.0);  // before the print, not behind it
      // Along the sheet's edges, more finely than it is planned.
      for (int k = 0; k <= 100; ++k) {
        const Vec3 right = 0.01 * k * kBoard.across_mm, down = 0.01 * k * kBoard.down_mm;
        for (const Vec3& p : {Vec3(kBoard.first_mm + right), Vec3(kBoard.first_mm + down),
                              Vec3(kBoard.first_mm + kBoard.down_mm + right),
                              Vec3(kBoard.first_mm + kBoard.across_mm + down)}) {
          const Vec3 p_cam = cam_from_world * p;
          const auto pixel = lens.project(p_cam);
          ASSERT_TRUE(pixel && lens.contains(*pixel)) << p.transpose();
          ASSERT_GE(p_cam.norm(), kClearance_mm - 1e-9);
        }
      }
    }
  }
}

TEST(BoardViews, CornersOfThePictureDistancesAndTiltsAreCovered) {
  for (const Lens& lens : lenses()) {
    double nearest_mm = std::numeric_limits<double>::infinity(), farthest_mm = 0.0;
    double most_tilt = 0.0;
    std::vector<Vec2> corners;
    for (const TimedPose& pose : views(lens)) {
      const Rigid3 cam_from_world = pose.world_from_camera.inverse();
      const Vec3 middle = cam_from_world * Vec3(10.0, 7.5, 0.0);
      nearest_mm = std::min(nearest_mm, middle.norm());
      farthest_mm = std::max(farthest_mm, middle.norm());
      const Vec3 normal = cam_from_world.rotation * Vec3::UnitZ();
      most_tilt = std::max(most_tilt, std::acos(normal.dot(middle.normalized())));
      for (int r = 0; r < 7; ++r)
        for (int c = 0; c < 9; ++c)
          corners.push_back(lens.project(cam_from_world * Vec3(2.5 * c, 2.5 * r, 0.0)).value());
    }
    EXPECT_GE(farthest_mm / nearest_mm, 2.0);
    EXPECT_GE(deg_from_rad(most_tilt), 40.0);
    // The corners of the picture, or of the square within a circular stop.
    const double w = lens.width, h = lens.height;
    const double inset = lens.stop.shape == StopShape::full ? 0.0 : 0.5 - std::sqrt(0.125);
    for (const double x : {inset, 1.0 - inset})
      for (const double y : {inset, 1.0 - inset}) {
        double nearest_px = std::numeric_limits<double>::infinity();
        for (const Vec2& p : corners)
          nearest_px = std::min(nearest_px, (p - Vec2(x * w, y * h)).norm());
        // The sheet's border, and its turn towards the lens, keep its corners off.
        EXPECT_LE(nearest_px, 0.15 * Vec2(w, h).norm()) << w << " x " << h << ": " << x << ' ' << y;
      }
  }
}

TEST(BoardViews, DependOnSeedAndIndexAlone) {
  const Lens lens = load_camera("misumi-v5506").lens;
  const PoseTrack all = views(lens), few = views(lens, 5), other = views(lens, 5, 2);
  EXPECT_EQ(tum_text({all.begin(), all.begin() + 5}), tum_text(few));
  EXPECT_EQ(tum_text(views(lens)), tum_text(all));
  for (std::size_t i = 0; i < few.size(); ++i)
    EXPECT_FALSE(few[i].world_from_camera.translation.isApprox(
        other[i].world_from_camera.translation, 1e-3));
}

TEST(BoardViews, AWorldElsewhereMovesTheViewsWithIt) {
  const Lens lens = load_camera("misumi-v5506").lens;
  const Rigid3 there(Quat(Eigen::AngleAxisd(1.1, Vec3(1, 2, -2) / 3.0)), Vec3(30.0, -8.0, 5.0));
  const BoardOutline moved{there * kBoard.first_mm, there.rotation * kBoard.across_mm,
                           there.rotation * kBoard.down_mm};
  const PoseTrack here = views(lens, 4);
  const PoseTrack away = plan_board_views(lens, moved, load_trajectory("chessboard").board,
                                          kClearance_mm, 4, 30.0, 1, "chessboard");
  for (std::size_t i = 0; i < here.size(); ++i) {
    const Rigid3 expected = there * here[i].world_from_camera;
    EXPECT_TRUE(away[i].world_from_camera.translation.isApprox(expected.translation, 1e-6));
    EXPECT_LE(angle_between_rad(away[i].world_from_camera.rotation, expected.rotation), 1e-6);
  }
}

TEST(BoardViews, WhatIsNotSeenIsToldApart) {
  const Lens lens = load_camera("misumi-v5506").lens;
  const LensProjector projector(lens);
  const auto sees = [&](const Rigid3& cam_from_world, double margin_px = 5.0) {
    return sees_board(projector, kBoard, cam_from_world, margin_px, kClearance_mm, 1.2);
  };
  const Vec3 middle(10.0, 7.5, 0.0);
  const auto facing = [&](const Quat& turn, const Vec3& at) {
    return Rigid3(turn, at - turn * middle);
  };
  const auto about = [](double angle, const Vec3& axis) {
    return Quat(Eigen::AngleAxisd(angle, axis));
  };
  EXPECT_TRUE(sees(facing(Quat::Identity(), Vec3(0, 0, 25))));
  EXPECT_TRUE(sees(facing(about(0.7, Vec3::UnitX()), Vec3(0, 0, 25))));
  EXPECT_FALSE(sees(facing(Quat::Identity(), Vec3(0, 0, -25))));           // behind the camera
  EXPECT_FALSE(sees(facing(about(kPi, Vec3::UnitY()), Vec3(0, 0, 25))));   // its back
  EXPECT_FALSE(sees(facing(Quat::Identity(), Vec3(22, 0, 25))));           // partly out
  EXPECT_FALSE(sees(facing(Quat::Identity(), Vec3(0, 0, 25)), 200.0));     // wide margin
  EXPECT_FALSE(sees(facing(Quat::Identity(), Vec3(0, 0, 3.9))));           // too near
  EXPECT_FALSE(sees(facing(about(1.25, Vec3::UnitX()), Vec3(0, 0, 60))));  // grazing
}

TEST(BoardViews, ABoardThatCannotBeSeenIsAnError) {
  const Lens lens = load_camera("misumi-v5506").lens;
  EXPECT_EQ(
      message_of([&] { plan_board_views(lens, kBoard, {.count = 3}, 500.0, 3, 30.0, 1, "mine"); }),
      "trajectory 'mine': view 0 does not see the whole board of 27.5 x 22.5 mm from 500 mm "
      "away or more, however it is turned");
  EXPECT_EQ(
      message_of([&] { plan_board_views(lens, kBoard, {.count = 3}, 4.0, 1, 30.0, 1, "mine"); }),
      "trajectory 'mine': 1 views, expected at least 2");
}

TEST(BoardViews, ThePoseRestsAroundItsFrame) {
  const PoseTrack track = views(load_camera("misumi-v5506").lens, 3);
  const auto at = [&](double frame) { return held_pose(track, frame).translation; };
  EXPECT_EQ(at(1.0), track[1].world_from_camera.translation);
  EXPECT_EQ(at(0.51), track[1].world_from_camera.translation);
  EXPECT_EQ(at(1.49), track[1].world_from_camera.translation);
  EXPECT_EQ(at(-3.0), track[0].world_from_camera.translation);
  EXPECT_EQ(at(7.0), track[2].world_from_camera.translation);
}

}  // namespace
}  // namespace rugae
