// The capsule against a wall that moves: spheres that shrink and sway by known lengths.

#include "render/clearance.h"

#include <gtest/gtest.h>

#include "tests/message_of.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

constexpr double kRadiusMm = 30.0;

// A sphere around the origin; `move` gives every vertex its place.
Scene sphere(const std::function<Vec3(double, const Vec3&)>& move, double reach_mm) {
  Scene scene{.name = "sphere",
              .wall = test::sphere_mesh(4, kRadiusMm),
              .rest_positions = {},
              .regions = {},
              .instances = {},
              .mucosa = Mucosa({}, 1),
              .motion = {},
              .notes = {},
              .resolved_yaml = {}};
  scene.rest_positions = scene.wall.vertices;
  scene.motion_reach_mm = reach_mm;
  scene.motion = [move, rest = scene.rest_positions](double time_s, std::vector<Vec3>& moved) {
    moved.clear();
    for (const Vec3& p : rest) moved.push_back(move(time_s, p));
  };
  return scene;
}

// A camera that keeps still at `place`, looked at every second.
PoseTrack still(const Vec3& place, int frames) {
  PoseTrack track;
  for (int i = 0; i < frames; ++i) track.push_back({double(i), Rigid3(Quat::Identity(), place)});
  return track;
}

std::string said_of(const Scene& scene, const PoseTrack& track, double clearance_mm) {
  return message_of([&] { check_moving_clearance(scene, track, clearance_mm, "path"); });
}

TEST(Clearance, AWallThatShrinksIsRefusedAtTheFrameWhereItComesTooNear) {
  // through a vertex of the sphere, so that the distance is the radius' to the last digit
  const Scene scene =
      sphere([](double t, const Vec3& p) { return Vec3(p * (1.0 - t / kRadiusMm)); }, 25.0);
  const Vec3 place = 20.0 * scene.wall.vertices[0].normalized();  // 10 - t from the wall
  EXPECT_EQ(said_of(scene, still(place, 6), 4.9), "no error");
  EXPECT_EQ(said_of(scene, still(place, 9), 4.9),
            "path: at frame 6 (6.00 s) the moving wall is 4.00 mm from the camera, expected at "
            "least 4.9 mm inside; move the wall less, or plan with more clearance");
}

TEST(Clearance, AWallThatPassesTheCameraLeavesItOutside) {
  const Scene scene =
      sphere([](double t, const Vec3& p) { return Vec3(p + Vec3(13.0 * t, 0, 0)); }, 26.0);
  EXPECT_EQ(said_of(scene, still(Vec3(-20.0, 0, 0), 1), 1.0), "no error");
  const std::string text = said_of(scene, still(Vec3(-20.0, 0, 0), 3), 1.0);
  EXPECT_EQ(text.substr(0, 35), "path: at frame 1 (1.00 s) the movin") << text;
  EXPECT_NE(text.find(", which is outside,"), std::string::npos) << text;
}

TEST(Clearance, FarFromTheWallAndWithoutMotionNothingIsRefused) {
  const Scene moving = sphere([](double, const Vec3& p) { return p; }, 5.0);
  EXPECT_EQ(said_of(moving, still(Vec3::Zero(), 3), 20.0), "no error");
  Scene rigid = sphere([](double, const Vec3& p) { return p; }, 0.0);
  rigid.motion = {};
  EXPECT_EQ(said_of(rigid, still(Vec3(29.0, 0, 0), 3), 20.0), "no error");
}

}  // namespace
}  // namespace rugae
