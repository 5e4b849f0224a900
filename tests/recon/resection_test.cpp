// A pose from known points.

#include "recon/resection.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "synthetic.h"

namespace rugae {
namespace {

struct Sights {
  std::vector<Vec3> points;
  std::vector<Vec2> rays;
};

// Camera 0 of a world: the points whose first observation is in it.
Sights sights_of_first_camera(const synthetic::World& world) {
  Sights s;
  for (std::size_t i = 0; i < world.tracks.size(); ++i) {
    const auto& o = world.tracks[i].observations.front();
    if (o.keyframe != 0) continue;
    s.points.push_back(world.points[i]);
    s.rays.push_back(o.ray);
  }
  return s;
}

TEST(Resection, ExactSightsGiveBackThePose) {
  const auto world = synthetic::make_world({.cameras = 3});
  const Sights s = sights_of_first_camera(world);
  ASSERT_GT(s.points.size(), 100u);
  const auto placed = place_by_points(s.points, s.rays, world.lens.fx, BundleOptions{});
  ASSERT_TRUE(placed.has_value());
  EXPECT_EQ(placed->inliers, static_cast<int>(s.points.size()));
  const Rigid3& truth = world.cam_from_world[0];
  EXPECT_TRUE((placed->cam_from_world.translation - truth.translation).norm() <= 1e-6);
  EXPECT_TRUE(angle_between_rad(placed->cam_from_world.rotation, truth.rotation) <= 1e-7);
}

TEST(Resection, HalfWrongSightsDoNotMatter) {
  const auto world = synthetic::make_world({.cameras = 3});
  Sights s = sights_of_first_camera(world);
  for (std::size_t i = 0; i < s.rays.size(); i += 2) {
    const auto u = random_uniform(1, Purpose::test, 40, i);
    s.rays[i] += Vec2(u[0] - 0.5, u[1] - 0.5);
  }
  const auto placed = place_by_points(s.points, s.rays, world.lens.fx, BundleOptions{});
  ASSERT_TRUE(placed.has_value());
  const Rigid3& truth = world.cam_from_world[0];
  // A few wrong sights land within the Huber loss' reach by chance.
  EXPECT_TRUE((placed->cam_from_world.translation - truth.translation).norm() <= 0.05);
  EXPECT_TRUE(placed->inliers <= static_cast<int>(0.55 * static_cast<double>(s.points.size())));
}

TEST(Resection, NonsenseIsNotPlaced) {
  const auto world = synthetic::make_world({.cameras = 3});
  Sights s = sights_of_first_camera(world);
  for (std::size_t i = 0; i < s.rays.size(); ++i) {
    const auto u = random_uniform(1, Purpose::test, 41, i);
    s.rays[i] = Vec2(2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
  }
  EXPECT_FALSE(place_by_points(s.points, s.rays, world.lens.fx, BundleOptions{}).has_value());
  s.points.resize(5);
  s.rays.resize(5);
  EXPECT_FALSE(place_by_points(s.points, s.rays, world.lens.fx, BundleOptions{}).has_value());
}

}  // namespace
}  // namespace rugae
