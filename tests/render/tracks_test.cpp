// Points followed over a sequence: a moving wall, a rolling shutter, every triangle tried.
#include "render/tracks.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/render/moving_world.h"

namespace rugae {
namespace {

using test::MovingWorld;

TEST(Tracks, PointsLandWhereTheyGoAndAreSeenWhereTheyAre) {
  const MovingWorld world(48, 36, 3, 0.9, 3.0);
  const FrameRenderer renderer = world.renderer({});
  const SceneMotion motion = world.motion(renderer);
  constexpr int kPoints = 400;
  const auto points = choose_track_points(renderer, motion, world.frames, kPoints, 7);
  ASSERT_EQ(points.size(), static_cast<std::size_t>(kPoints));
  // Between the poses of two rows the path is taken as straight: it nods with up to 0.144 rad per
  // frame^2 and rows are 0.025 frames apart, 0.144 0.025^2 / 8 rad = 1.1e-5 rad, at up to 40 mm.
  constexpr double kLands_px = 1e-3, kDepth_mm = 5e-4;
  int visible = 0, hidden = 0, outside = 0;
  for (const int frame : {1, 4, 9}) {
    const auto samples = follow_tracks(renderer, motion.view(frame), points);
    std::size_t next = 0;
    for (const TrackPoint& point : points) {
      const Vec3f label(static_cast<float>(point.triangle), point.b1, point.b2);
      const auto landing = world.follow(label, frame);
      if (next == samples.size() || samples[next].point != point.point) {
        ++outside;
        EXPECT_TRUE(!landing || !world.camera.lens.contains(landing->pixel));
        continue;
      }
      const TrackSample& sample = samples[next++];
      ASSERT_TRUE(landing);
      EXPECT_TRUE((sample.pixel - landing->pixel).norm() <= kLands_px);
      const Rigid3 pose = world.pose(landing->frame);
      EXPECT_NEAR(sample.depth_mm, (pose.inverse() * landing->point).z(), kDepth_mm);
      TriangleMesh wall;
      wall.vertices = world.wall_at(landing->frame);
      wall.triangles = world.rest.triangles;
      const Vec3 to = landing->point - landing->eye;
      const bool along =
          triangle_normal(wall, static_cast<std::size_t>(point.triangle)).dot(to) > 0.0;
      const auto nearest = test::brute_force(wall, landing->eye, to.normalized());
      const bool met = nearest && nearest->range_mm < Raycaster::kReach * to.norm();
      EXPECT_EQ(sample.visible, along == point.seen_along_normal && !met) << point.point;
      (sample.visible ? visible : hidden) += 1;
    }
    EXPECT_EQ(next, samples.size());
  }
  EXPECT_GT(visible, 200);
  EXPECT_GT(hidden, 5);
  EXPECT_GT(outside, 50);
}

// Where the stop leaves no label, no point is followed either.
TEST(Tracks, NoneLandsUnderTheFieldStop) {
  MovingWorld world(48, 36, 3, 0.9, 3.0);
  world.camera.lens.stop = {StopShape::circle, 0.8};
  const FrameRenderer renderer = world.renderer({});
  const SceneMotion motion = world.motion(renderer);
  const auto points = choose_track_points(renderer, motion, world.frames, 400, 7);
  int covered = 0;
  for (const int frame : {1, 4, 9}) {
    std::set<int> listed;
    for (const TrackSample& sample : follow_tracks(renderer, motion.view(frame), points)) {
      EXPECT_TRUE(world.camera.lens.contains(sample.pixel)) << sample.pixel.transpose();
      listed.insert(sample.point);
    }
    for (const TrackPoint& point : points) {
      const Vec3f label(static_cast<float>(point.triangle), point.b1, point.b2);
      const auto landing = world.follow(label, frame);
      const bool in_image = landing && (landing->pixel.array() >= 0.0).all() &&
                            landing->pixel.x() < 48.0 && landing->pixel.y() < 36.0;
      covered += in_image && !listed.contains(point.point);
    }
  }
  EXPECT_GT(covered, 50);
}

TEST(Tracks, AreDrawnBySeedOverTheSequence) {
  const MovingWorld world(32, 24, 3, 0.0);
  const FrameRenderer renderer = world.renderer({});
  const SceneMotion motion = world.motion(renderer);
  const auto one = choose_track_points(renderer, motion, world.frames, 64, 1),
             again = choose_track_points(renderer, motion, world.frames, 64, 1),
             other = choose_track_points(renderer, motion, world.frames, 64, 2);
  EXPECT_EQ(track_points_text(one), track_points_text(again));
  EXPECT_NE(track_points_text(one), track_points_text(other));
  std::set<int> triangles;
  for (const TrackPoint& point : one) triangles.insert(point.triangle);
  EXPECT_GT(triangles.size(), 40u);
}

}  // namespace
}  // namespace rugae
