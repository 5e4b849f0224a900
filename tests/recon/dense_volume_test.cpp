// Fusion of depth maps that are known.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "dense_scene.h"
#include "recon/dense/albedo.h"
#include "recon/dense/volume.h"
#include "recon/mesh_pieces.h"

namespace rugae {
namespace {

using namespace testing;

DepthMap exact_map(const DenseWall& wall, const Rigid3& cam_from_world, float sigma,
                   const PinholeGrid& grid = small_grid()) {
  DepthMap map{grid, cam_from_world, true_depth(wall, cam_from_world, grid), {}};
  map.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(sigma));
  map.sigma.setTo(std::nanf(""), map.depth != map.depth);
  return map;
}

/// 96 degrees each way: six views cover all directions.
PinholeGrid square_grid() { return {160, 160, 72.0, 72.0, 80.0, 80.0}; }

std::vector<Rigid3> six_views(double scale) {
  std::vector<Rigid3> views;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      views.push_back(
          looking(scale * Vec3(2.0, -1.0, 3.0), sign * (Vec3::Unit(axis) + Vec3(1e-3, 0.0, 0.0))));
  return views;
}

TriangleMesh sphere_from_inside(double scale) {
  DistanceVolume volume(scale * 1.0);
  for (const Rigid3& view : six_views(scale))
    volume.integrate(
        exact_map(sphere_wall(scale * 30.0), view, static_cast<float>(scale * 0.1), square_grid()),
        {});
  return volume.extract();
}

// Two maps that differ: w = 1/0.1^2 and 1/0.2^2, so the mean is 50 + 0.4 * 25 / 125 = 50.08, and
// its sigma, the maps erring alike, (10 + 5) / 125.
TEST(DenseVolume, TheWallIsTheMeanWeightedByCertainty) {
  DistanceVolume volume(0.8);
  volume.integrate(exact_map(plane_wall(Vec3::UnitZ(), 50.0), {}, 0.1f), {});
  volume.integrate(exact_map(plane_wall(Vec3::UnitZ(), 50.4), {}, 0.2f), {});
  const auto surface = volume.extract();
  ASSERT_GE(surface.vertices.size(), 1000u);
  ASSERT_EQ(surface.sigma.size(), surface.vertices.size());
  int inner = 0;
  for (std::size_t v = 0; v < surface.sigma.size(); ++v) {
    const Vec3& p = surface.vertices[v];
    if (std::abs(p.x()) > 40.0 || std::abs(p.y()) > 30.0) continue;  // the rim of the pictures
    ++inner;
    ASSERT_NEAR(p.z(), 50.08, 1e-3);
    ASSERT_NEAR(surface.sigma[v], 15.0 / 125.0, 1e-3);
  }
  EXPECT_GE(inner, 1000);
}

TEST(DenseVolume, InsideOfASphereComesBackRoundAndPointsOutward) {
  const auto surface = sphere_from_inside(1.0);
  ASSERT_FALSE(surface.empty());
  check_mesh(surface, "sphere");
  double square = 0.0;
  for (const Vec3& p : surface.vertices) square += std::pow(p.norm() - 30.0, 2);
  // A chord of a voxel's side, 1 mm, is 1 / (8 * 30) = 0.004 mm off; steps between pixels add to
  // that. A hundredth of a voxel is not missed by more than two.
  EXPECT_LE(std::sqrt(square / static_cast<double>(surface.vertices.size())), 0.02);
  const double volume = 4.0 / 3.0 * kPi * std::pow(30.0, 3);
  EXPECT_NEAR(signed_volume_mm3(surface), volume, 0.01 * volume);
  const EdgeReport edges = inspect_edges(surface);
  EXPECT_EQ(edges.flipped, 0u);
  EXPECT_EQ(edges.open, 0u);
}

TEST(DenseVolume, AnObliqueWallIsWhereItIs) {
  // 60 degrees: distances along the ray are twice those from the wall.
  const DenseWall wall = plane_wall({std::sin(kPi / 3.0), 0.0, std::cos(kPi / 3.0)}, 25.0);
  const Vec3 n = wall.normal(Vec3::Zero());
  DistanceVolume volume(0.8);
  volume.integrate(exact_map(wall, {}, 0.1f), {});
  const auto surface = volume.extract();
  ASSERT_GE(surface.vertices.size(), 500u);
  int near = 0;
  for (const Vec3& p : surface.vertices) {
    // Farther off the depths of neighbouring pixels are voxels apart.
    if (p.norm() > 50.0) continue;
    ++near;
    ASSERT_NEAR(n.dot(p), 25.0, 0.05);
  }
  EXPECT_GE(near, 500);
}

TEST(DenseVolume, ScalingTheWorldScalesTheSurfaceOnly) {
  constexpr double kScale = 1024.0;  // a power of two: exact in floating point
  const auto a = sphere_from_inside(1.0), b = sphere_from_inside(kScale);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  for (std::size_t v = 0; v < a.sigma.size(); ++v) {
    ASSERT_LE((b.vertices[v] / kScale - a.vertices[v]).norm(), 1e-4);
    ASSERT_NEAR(b.sigma[v] / kScale, a.sigma[v], 1e-4 * a.sigma[v]);
  }
}

TEST(DenseVolume, OneThreadAndTwoGiveTheSameBytes) {
  const auto run = [](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return sphere_from_inside(1.0);
  };
  const auto a = run(1), b = run(2);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t v = 0; v < a.sigma.size(); ++v) {
    ASSERT_TRUE(a.vertices[v] == b.vertices[v]);
    ASSERT_TRUE(a.sigma[v] == b.sigma[v]);
  }
  ASSERT_TRUE(a.triangles == b.triangles);
}

TEST(DenseVolume, NothingMakesNothing) {
  DistanceVolume volume(1.0);
  EXPECT_TRUE(volume.extract().empty());
  DepthMap unknown = exact_map(plane_wall(Vec3::UnitZ(), 50.0), {}, 0.1f);
  unknown.depth.setTo(std::nanf(""));
  volume.integrate(unknown, {});
  EXPECT_TRUE(volume.extract().empty());
}

// --- Colour ----------------------------------------------------------------------------------

// A wall of one albedo, nearer on one side, seen obliquely on the other.
TEST(DenseAlbedo, IsTheWallsOwnWhateverTheLight) {
  const DenseWall wall = sphere_wall(30.0);
  const Rigid3 view = looking({8.0, -5.0, 10.0}, {0.2, 0.1, 1.0});
  const WideFrame frame = draw_frame(
      wall, [](const Vec3&) { return 0.6; }, view, small_grid(), 12.0, 0.0, 0);
  const cv::Mat gain(frame.known.size(), CV_32F, cv::Scalar(1.0));
  const cv::Mat albedo = albedo_of(frame, gain, exact_map(wall, view, 0.1f));
  int known = 0;
  for (int y = 2; y < albedo.rows - 2; ++y)
    for (int x = 2; x < albedo.cols - 2; ++x) {
      const auto& a = albedo.at<cv::Vec3f>(y, x);
      if (!(a[0] > 0.0f)) continue;
      ++known;
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(a[c], 0.6 * 12.0 * 12.0, 0.01 * 0.6 * 144.0);
    }
  EXPECT_GE(known, 15000);
}

TEST(DenseAlbedo, OneGainForAll) {
  std::vector<Vec3f> albedos;
  for (int i = 1; i <= 100; ++i) albedos.push_back(Vec3f::Constant(3.0f * static_cast<float>(i)));
  albedos.push_back(Vec3f::Zero());
  std::vector<Vec3f> brighter;
  for (const Vec3f& albedo : albedos) brighter.push_back(8.0f * albedo);
  to_display(albedos);
  to_display(brighter);
  for (std::size_t i = 0; i < albedos.size(); ++i)
    EXPECT_LE((albedos[i] - brighter[i]).norm(), 1e-6f);
  EXPECT_EQ(albedos.back(), Vec3f(Vec3f::Zero()));
  for (std::size_t i = 1; i < 97; ++i) EXPECT_GT(albedos[i][0], albedos[i - 1][0]);
  EXPECT_LE(albedos[99].maxCoeff(), 1.0f);
}

// --- Pieces ----------------------------------------------------------------------------------

TEST(MeshPieces, SmallOnesGoAndTheRestKeepsItsOrder) {
  TriangleMesh mesh;
  for (int i = 0; i < 12; ++i) {
    mesh.vertices.push_back({static_cast<double>(i), static_cast<double>(i * i), 0.0});
    mesh.colors.push_back(Vec3f::Constant(0.05f * static_cast<float>(i)));
  }
  // A lone triangle first, then a strip of six.
  mesh.triangles.emplace_back(0, 2, 1);
  for (int i = 3; i < 9; ++i) mesh.triangles.emplace_back(i, i + 1, i + 2);
  const std::vector<int> large = vertices_of_large_pieces(mesh, 0.5);
  EXPECT_EQ(large, (std::vector<int>{3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(vertices_of_large_pieces(mesh, 0.1).size(), 11u);  // vertex 11 is nobody's
  const TriangleMesh part = part_of(mesh, large);
  ASSERT_EQ(part.triangles.size(), 6u);
  EXPECT_TRUE(part.triangles[0] == Vec3i(0, 1, 2));
  EXPECT_TRUE(part.vertices[0] == mesh.vertices[3]);
  EXPECT_TRUE(part.colors[7] == mesh.colors[10]);
}

}  // namespace
}  // namespace rugae
