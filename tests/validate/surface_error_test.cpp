#include "validate/surface_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/check.h"
#include "tests/validate/shapes.h"
#include "validate/align.h"

namespace rugae {
namespace {

const SurfaceOptions kFew{.samples = 20'000, .thresholds_mm = {0.5, 0.99, 1.01, 2.0}};

TEST(SurfaceError, ConcentricSpheresAreTheirDistanceApart) {
  // Facets lie inside their sphere by at most r (1 - cos a), a half their diagonal's angle: for 64
  // rings a = pi / (64 sqrt 2) and r = 21 mm, 0.013 mm.
  constexpr double kFacets_mm = 0.02;
  const auto error = surface_error(shapes::sphere(21, 64), shapes::sphere(20, 64), kFew);
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->estimate_to_truth_mm.mean, 1.0, kFacets_mm);
  EXPECT_NEAR(error->estimate_to_truth_mm.rmse, 1.0, kFacets_mm);
  EXPECT_NEAR(error->truth_to_estimate_mm.median, 1.0, kFacets_mm);
  EXPECT_NEAR(error->chamfer_mean_mm, 1.0, kFacets_mm);
  EXPECT_NEAR(error->chamfer_median_mm, 1.0, kFacets_mm);
}

TEST(SurfaceError, ThresholdsOnParallelPlanes) {
  const auto error =
      surface_error(shapes::plane(40, 40, 4, 1.0), shapes::plane(40, 40, 4, 0.0), kFew);
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->estimate_to_truth_mm.rmse, 1.0, 1e-12);
  EXPECT_EQ(error->at[1].f, 0.0);  // within 0.99 mm: nothing
  EXPECT_EQ(error->at[2].precision, 1.0);
  EXPECT_EQ(error->at[2].recall, 1.0);
  EXPECT_EQ(error->at[2].f, 1.0);
}

TEST(SurfaceError, HalfAMapIsAccurateAndHalfComplete) {
  const auto error =
      surface_error(shapes::plane(20, 40, 4, 0.0), shapes::plane(40, 40, 4, 0.0), kFew);
  ASSERT_TRUE(error);
  EXPECT_TRUE(error->estimate_to_truth_mm.max <= 1e-12);
  EXPECT_EQ(error->at[0].precision, 1.0);
  EXPECT_NEAR(error->at[0].recall, 20.5 / 40.0, 1e-3);  // the half and a strip of 0.5 mm
  EXPECT_NEAR(error->at[0].f, 2.0 * (20.5 / 40.0) / (1.0 + 20.5 / 40.0), 1e-3);
  EXPECT_NEAR(error->truth_to_estimate_mm.mean, 5.0, 0.02);  // half at 0, half uniform in 0..20
}

TEST(SurfaceError, SigmaIsHeldAgainstTheError) {
  // Vertices 1 mm off: half of them say 0.4 mm, two and a half sigma; the others 0.8 mm.
  TriangleMesh map = shapes::plane(40, 40, 4, 1.0);
  EXPECT_FALSE(surface_error(map, shapes::plane(40, 40, 4, 0.0), kFew)->sigma);
  for (std::size_t v = 0; v < map.vertices.size(); ++v) map.sigma.push_back(v % 2 ? 0.4f : 0.8f);
  const auto here = surface_error(map, shapes::plane(40, 40, 4, 0.0), kFew);
  ASSERT_TRUE(here->sigma);
  const auto n = static_cast<double>(map.vertices.size());
  EXPECT_EQ(here->sigma->within_1, 0.0);
  EXPECT_EQ(here->sigma->within_2, std::ceil(n / 2.0) / n);
  EXPECT_NEAR(here->sigma->median_ratio, 1.25, 1e-6);
  EXPECT_NEAR(here->sigma->median_sigma_mm, 0.8, 1e-6);
  // A map in metres with its sigma in metres.
  const Sim3 metres{1e-3, Quat::Identity(), Vec3::Zero()};
  const auto there = surface_error(transformed(transformed(map, metres), metres.inverse()),
                                   shapes::plane(40, 40, 4, 0.0), kFew);
  EXPECT_NEAR(there->sigma->median_ratio, 1.25, 1e-5);
  EXPECT_NEAR(transformed(map, metres).sigma[0], 0.8e-3, 1e-9);
}

TEST(SurfaceError, NoSurfaceIsEmpty) {
  EXPECT_FALSE(surface_error({}, shapes::plane(4, 4, 1, 0), kFew));
  EXPECT_FALSE(surface_error(shapes::plane(4, 4, 1, 0), {}, kFew));
  EXPECT_THROW(surface_error({}, {}, {.samples = 0}), Error);
}

TEST(SurfaceError, MovingTheWorldChangesNothing) {
  const TriangleMesh a = shapes::sphere(21, 24), b = shapes::sphere(20, 24, Vec3(0.3, 0.1, 0));
  const Sim3 motion{1.0, Quat(Eigen::AngleAxisd(1.0, Vec3(1, 2, 3).normalized())),
                    Vec3(100, -50, 20)};
  const auto here = surface_error(a, b, kFew);
  const auto there = surface_error(transformed(a, motion), transformed(b, motion), kFew);
  // Rounding may move a sample over a triangle's edge: one of 20,000 by a triangle's size.
  constexpr double kOneSample_mm = 1e-4;
  EXPECT_NEAR(here->estimate_to_truth_mm.rmse, there->estimate_to_truth_mm.rmse, kOneSample_mm);
  EXPECT_NEAR(here->truth_to_estimate_mm.mean, there->truth_to_estimate_mm.mean, kOneSample_mm);
  EXPECT_NEAR(here->at[1].f, there->at[1].f, 1e-3);
}

TEST(SampleSurface, SpreadsEvenlyByArea) {
  // One large and one small rectangle, areas 30:1; and the large one's own quarters.
  TriangleMesh mesh = shapes::plane(30, 10, 10, 0);
  const auto first = static_cast<int>(mesh.vertices.size());
  for (const Vec3& v : shapes::plane(10, 1, 1, 5).vertices) mesh.vertices.push_back(v);
  for (const Vec3i& t : shapes::plane(10, 1, 1, 5).triangles)
    mesh.triangles.push_back(t + Vec3i::Constant(first));
  const auto points = sample_surface(mesh, 31'000);
  ASSERT_EQ(points.size(), 31'000u);
  int small = 0, left = 0;
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) {
    if (p.z() > 1.0) {
      ++small;
    } else {
      left += p.x() < 15.0;
      sum += p;
    }
  }
  EXPECT_NEAR(small, 1000, 2);
  EXPECT_NEAR(left, 15'000, 150);
  EXPECT_NEAR(sum.x() / 30'000, 15.0, 0.05);
  EXPECT_NEAR(sum.y() / 30'000, 5.0, 0.05);
}

TEST(Icp, FindsASmallMotion) {
  // An ellipsoid: its shape fixes the rotation.
  TriangleMesh mesh = shapes::sphere(1, 40);
  for (Vec3& v : mesh.vertices) v = Vec3(40 * v.x(), 25 * v.y(), 15 * v.z());
  const auto target = sample_surface(mesh, 20'000);
  const Sim3 motion{1.0, Quat(Eigen::AngleAxisd(0.05, Vec3(1, 1, 0).normalized())), Vec3(1, -1, 2)};
  std::vector<Vec3> source;
  for (std::size_t i = 0; i < target.size(); i += 4) source.push_back(motion.inverse() * target[i]);
  const IcpResult found = icp(source, target, {.max_iterations = 200});
  ASSERT_TRUE(found.converged);
  EXPECT_NEAR(found.used_share, 1.0, 1e-12);
  // The source points are target points: the right motion leaves no distance.
  EXPECT_TRUE(found.rmse_mm <= 0.05) << found.rmse_mm;
  EXPECT_TRUE(angle_between_rad(found.target_from_source.rotation, motion.rotation) <= 0.005);
  EXPECT_EQ(found.target_from_source.scale, 1.0);
}

TEST(Icp, FindsAScaleWhenAsked) {
  TriangleMesh mesh = shapes::sphere(1, 40);
  for (Vec3& v : mesh.vertices) v = Vec3(40 * v.x(), 25 * v.y(), 15 * v.z());
  const auto target = sample_surface(mesh, 20'000);
  std::vector<Vec3> source;
  for (std::size_t i = 0; i < target.size(); i += 4) source.push_back(target[i] / 1.05);
  const IcpResult found = icp(source, target, {.max_iterations = 200, .with_scale = true});
  ASSERT_TRUE(found.converged);
  EXPECT_NEAR(found.target_from_source.scale, 1.05, 0.005);
}

TEST(Icp, SaysWhenNothingIsNear) {
  const auto target = sample_surface(shapes::sphere(10, 10), 500);
  std::vector<Vec3> source;
  for (const Vec3& p : target) source.push_back(p + Vec3(1000, 0, 0));
  EXPECT_FALSE(icp(source, target, {}).converged);
  EXPECT_FALSE(icp({}, target, {}).converged);
  EXPECT_THROW(icp(source, target, {.max_distance_mm = 0.0}), Error);
}

}  // namespace
}  // namespace rugae
