// What lies around a frame that is no key frame.

#include "recon/frames_between.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rugae {
namespace {

constexpr double kExact = 1e-12;
constexpr double kTurn_rad = 0.01;  // a frame

/// A camera that goes on at a steady pace and turns, at a frame.
Rigid3 pose_at(double frame) {
  const Rigid3 world_from_cam{Quat(Eigen::AngleAxisd(kTurn_rad * frame, Vec3::UnitY())),
                              Vec3(0.3 * frame, -0.1 * frame, 0.2)};
  return world_from_cam.inverse();
}

/// Key frames 10, 14 and 20 of that camera.
Structure steady_camera() {
  Structure structure;
  for (const int frame : {10, 14, 20}) {
    structure.frames.push_back(frame);
    structure.cam_from_world.push_back(pose_at(frame));
    structure.placed.push_back(true);
  }
  return structure;
}

void expect_same(const std::optional<Rigid3>& found, const Rigid3& truth) {
  ASSERT_TRUE(found.has_value());
  EXPECT_TRUE((found->translation - truth.translation).norm() <= kExact);
  EXPECT_TRUE(angle_between_rad(found->rotation, truth.rotation) <= 1e-7);
}

TEST(FramesBetween, TheNearerKeyframeIsFirstAndTheMotionIsShared) {
  const Structure structure = steady_camera();
  const Between found = between(structure, placed_keyframes(structure), 18);
  EXPECT_EQ(found.keyframes, (std::vector<int>{2, 1}));
  expect_same(found.cam_from_world, pose_at(18));
  EXPECT_FALSE(found.beyond.has_value());
}

TEST(FramesBetween, MotionGoesOnAtBothEnds) {
  const Structure structure = steady_camera();
  for (const auto& [frame, keyframe] : {std::pair{24, 2}, {7, 0}}) {
    const Between found = between(structure, placed_keyframes(structure), frame);
    EXPECT_EQ(found.keyframes, std::vector<int>{keyframe});
    EXPECT_FALSE(found.cam_from_world.has_value());
    expect_same(found.beyond, pose_at(frame));
  }
}

// Frames 3, 5, 6 and 9 have a pose: what each of the others may go by.
TEST(FramesBetween, FramesLeadToThoseBesideThem) {
  std::vector<std::optional<Rigid3>> poses(12);
  for (const int frame : {3, 5, 6, 9}) poses[static_cast<std::size_t>(frame)] = pose_at(frame);
  const auto expect_places = [&](int frame, int steady, const std::vector<int>& nearest) {
    const std::vector<Rigid3> places = beside_frames(poses, frame);
    ASSERT_EQ(places.size(), static_cast<std::size_t>(steady) + nearest.size()) << frame;
    for (int i = 0; i < steady; ++i)
      expect_same(places[static_cast<std::size_t>(i)], pose_at(frame));
    for (std::size_t i = 0; i < nearest.size(); ++i)
      expect_same(places[static_cast<std::size_t>(steady) + i], pose_at(nearest[i]));
  };
  expect_places(4, 2, {3, 5});  // between, and on from 6 and 5; one frame alone leads nowhere
  expect_places(7, 2, {6, 9});  // between, and on from 5 and 6; 9 is the last
  expect_places(8, 1, {6, 9});  // two frames on from two that are one apart: too far
  expect_places(10, 1, {9});    // on from 6 and 9
  expect_places(0, 0, {3});     // three frames before two that are two apart: too far
  poses.assign(12, std::nullopt);
  EXPECT_TRUE(beside_frames(poses, 5).empty());
}

TEST(FramesBetween, NothingIsKnownFartherOnOrFromOneKeyframe) {
  Structure structure = steady_camera();
  EXPECT_TRUE(between(structure, placed_keyframes(structure), 26).beyond.has_value());
  EXPECT_FALSE(between(structure, placed_keyframes(structure), 27).beyond.has_value());
  EXPECT_FALSE(between(structure, placed_keyframes(structure), 5).beyond.has_value());
  structure.placed[0] = structure.placed[1] = false;
  EXPECT_FALSE(between(structure, placed_keyframes(structure), 21).beyond.has_value());
}

}  // namespace
}  // namespace rugae
