// Bundle adjustment: derivatives against differences, and the minimum it must find.

#include "recon/bundle.h"

#include <ceres/gradient_checker.h>
#include <ceres/manifold.h>
#include <ceres/product_manifold.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/random.h"
#include "recon/reprojection_cost.h"
#include "synthetic.h"

namespace rugae {
namespace {

using PoseManifold =
    ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;

// Relative; Ceres' own default tolerance for Ridders differences is 1e-8 at best.
constexpr double kDerivative = 1e-7;

TEST(ReprojectionCost, DerivativesAgreeWithDifferences) {
  PoseManifold pose_manifold;
  ceres::EuclideanManifold<3> point_manifold;
  const std::vector<const ceres::Manifold*> manifolds = {&pose_manifold, &point_manifold};
  for (int i = 0; i < 50; ++i) {
    const auto q = random_normal(3, Purpose::test, 1, i), t = random_normal(3, Purpose::test, 2, i);
    const Quat rotation = Quat(q[0], q[1], q[2], q[3]).normalized();
    const Vec3 point(t[0], t[1], t[2]);
    // Any translation that brings the point in front of the camera.
    const Vec3 translation = Vec3(0.3 * t[3], 0.1, 4.0) - rotation * point;
    double pose[7] = {rotation.x(),    rotation.y(),    rotation.z(),   rotation.w(),
                      translation.x(), translation.y(), translation.z()};
    double x[3] = {point.x(), point.y(), point.z()};
    const double* parameters[] = {pose, x};
    ceres::GradientChecker::ProbeResults results;
    const ReprojectionCost cost(Vec2(0.1, -0.2), 268.0);
    EXPECT_TRUE(ceres::GradientChecker(&cost, &manifolds, ceres::NumericDiffOptions{})
                    .Probe(parameters, kDerivative, &results))
        << results.error_log;
    const PoseCost pose_cost(Vec2(0.1, -0.2), 268.0, point);
    const std::vector<const ceres::Manifold*> pose_only = {&pose_manifold};
    EXPECT_TRUE(ceres::GradientChecker(&pose_cost, &pose_only, ceres::NumericDiffOptions{})
                    .Probe(parameters, kDerivative, &results))
        << results.error_log;
  }
}

TEST(ReprojectionCost, IsTheProjectionOfTheCamera) {
  const Rigid3 pose(Quat(0.9, 0.1, -0.3, 0.2).normalized(), Vec3(0.1, 0.2, 3.0));
  const Vec3 point(0.4, -0.3, 0.6);
  const Vec3 p = pose * point;
  const Vec2 ray(0.05, 0.02);
  const auto& q = pose.rotation;
  const double block[7] = {q.x(), q.y(), q.z(), q.w(), 0.1, 0.2, 3.0};
  const double* parameters[] = {block, point.data()};
  double r[2] = {};
  ASSERT_TRUE(ReprojectionCost(ray, 100.0).Evaluate(parameters, r, nullptr));
  EXPECT_NEAR(r[0], 100.0 * (p.x() / p.z() - 0.05), 1e-12);
  EXPECT_NEAR(r[1], 100.0 * (p.y() / p.z() - 0.02), 1e-12);
  EXPECT_NEAR(reprojection_px(pose, point, ray, 100.0), Vec2(r[0], r[1]).norm(), 1e-12);
}

TEST(ReprojectionCost, RefusesPointsBehindTheCamera) {
  const double block[7] = {0, 0, 0, 1, 0, 0, 0};
  const double behind[3] = {0.1, 0.1, -1.0};
  const double* parameters[] = {block, behind};
  double r[2] = {};
  EXPECT_FALSE(ReprojectionCost(Vec2::Zero(), 100.0).Evaluate(parameters, r, nullptr));
}

Structure true_structure(const synthetic::World& world) {
  Structure s;
  s.frames = world.frames;
  s.placed.assign(world.frames.size(), true);
  s.cam_from_world = world.cam_from_world;
  s.tracks = world.tracks;
  for (std::size_t i = 0; i < s.tracks.size(); ++i) {
    s.tracks[i].point = world.points[i];
    s.tracks[i].triangulated = true;
  }
  return s;
}

TEST(Bundle, FindsBackFromAPerturbation) {
  const synthetic::World world = synthetic::make_world({.cameras = 8});
  Structure s = true_structure(world);
  for (std::size_t k = 1; k < s.cam_from_world.size(); ++k) {
    const auto g = random_normal(1, Purpose::test, 11, k),
               h = random_normal(1, Purpose::test, 12, k);
    s.cam_from_world[k] =
        Rigid3(Quat(Eigen::AngleAxisd(0.01 * g[3], Vec3(g[0], g[1], g[2]).normalized())),
               0.3 * Vec3(h[0], h[1], h[2])) *
        s.cam_from_world[k];
  }
  BundleScope scope;
  scope.function_tolerance = 1e-10;
  const BundleReport report = bundle_adjust(s, world.lens.fx, BundleOptions{}, scope);
  EXPECT_TRUE(report.converged);
  EXPECT_TRUE(report.final_cost <= 1e-12 * report.initial_cost) << report.final_cost;
  const auto error = synthetic::path_error(s, world);
  EXPECT_TRUE(error.rmse <= 1e-6 * error.path_extent) << error.rmse;
}

TEST(Bundle, HoldsWhatIsNotFree) {
  const synthetic::World world = synthetic::make_world({.cameras = 8, .noise_px = 0.5});
  Structure s = true_structure(world);
  BundleScope scope;
  scope.free_keyframes = {3, 4};
  bundle_adjust(s, world.lens.fx, BundleOptions{}, scope);
  for (int k = 0; k < 8; ++k) {
    const bool moved =
        (s.cam_from_world[k].translation - world.cam_from_world[k].translation).norm() > 0.0;
    EXPECT_EQ(moved, k == 3 || k == 4) << k;
  }
}

// Who has it at hand what each key frame sees gets the same, to the bit.
TEST(Bundle, KnownTracksChangeNothing) {
  const synthetic::World world = synthetic::make_world({.cameras = 8, .noise_px = 0.5});
  Structure looked_for = true_structure(world), known = looked_for;
  BundleScope scope;
  scope.free_keyframes = {4, 2};
  bundle_adjust(looked_for, world.lens.fx, BundleOptions{}, scope);
  const SeenTracks seen = seen_tracks(known);
  ASSERT_NE(seen[4], seen[2]);
  scope.seen = &seen;
  bundle_adjust(known, world.lens.fx, BundleOptions{}, scope);
  for (int k = 0; k < 8; ++k) {
    EXPECT_EQ(known.cam_from_world[k].translation, looked_for.cam_from_world[k].translation);
    EXPECT_EQ(known.cam_from_world[k].rotation.coeffs(),
              looked_for.cam_from_world[k].rotation.coeffs());
  }
  for (std::size_t t = 0; t < known.tracks.size(); ++t)
    EXPECT_EQ(known.tracks[t].point, looked_for.tracks[t].point);
}

// One camera fixes no world: the first placed key frame stays where it is, to the bit.
TEST(Bundle, TheFirstPlacedKeyframeHoldsTheWorld) {
  const synthetic::World world = synthetic::make_world({.cameras = 6, .noise_px = 0.5});
  Structure s = true_structure(world);
  s.placed[0] = false;
  bundle_adjust(s, world.lens.fx, BundleOptions{}, {});
  EXPECT_EQ(s.cam_from_world[1].translation, world.cam_from_world[1].translation);
  EXPECT_EQ(s.cam_from_world[1].rotation.coeffs(), world.cam_from_world[1].rotation.coeffs());
  EXPECT_NE(s.cam_from_world[2].translation, world.cam_from_world[2].translation);
}

TEST(Bundle, WhatIsNoInlierPullsNothing) {
  const synthetic::World world = synthetic::make_world({.cameras = 8});
  Structure s = true_structure(world);
  for (std::size_t i = 0; i < s.tracks.size(); i += 3) {
    auto& observation = s.tracks[i].observations.back();
    observation.ray += Vec2(0.3, -0.2);
    observation.inlier = false;
  }
  const BundleReport report = bundle_adjust(s, world.lens.fx, BundleOptions{}, {});
  EXPECT_TRUE(report.final_cost <= 1e-12) << report.final_cost;  // rounding of exact tracks
  const auto error = synthetic::path_error(s, world);
  EXPECT_TRUE(error.rmse <= 1e-9 * error.path_extent) << error.rmse;
}

TEST(Bundle, SinglePoseIsFoundBack) {
  const synthetic::World world = synthetic::make_world({.cameras = 2});
  std::vector<Vec3> points;
  std::vector<Vec2> rays;
  for (std::size_t i = 0; i < world.tracks.size(); ++i) {
    points.push_back(world.points[i]);
    rays.push_back(world.tracks[i].observations.front().ray);
  }
  Rigid3 pose = Rigid3(Quat(Eigen::AngleAxisd(0.05, Vec3::UnitX())), Vec3(1.0, -1.0, 0.5)) *
                world.cam_from_world[0];
  refine_pose(pose, points, rays, world.lens.fx, 1.0, 50);
  EXPECT_TRUE((pose.translation - world.cam_from_world[0].translation).norm() <= 1e-9);
  EXPECT_TRUE(angle_between_rad(pose.rotation, world.cam_from_world[0].rotation) <= 1e-7);
}

}  // namespace
}  // namespace rugae
