#include "render/raycaster.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include "core/check.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

using test::brute_force;
using test::folded_mesh;
using test::random_direction;

std::vector<Vec3> directions(int count, std::uint32_t first = 0) {
  std::vector<Vec3> rays;
  for (int i = 0; i < count; ++i) rays.push_back(random_direction(first + i));
  return rays;
}

TEST(Raycaster, AgreesWithTryingEveryTriangle) {
  const TriangleMesh mesh = folded_mesh(3);
  const Raycaster raycaster(mesh);
  const Vec3 origin(3.0, -4.0, 5.0);
  const auto rays = directions(1000);
  std::vector<Hit> hits(rays.size());
  raycaster.intersect(origin, rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto expected = brute_force(mesh, origin, rays[i]);
    ASSERT_TRUE(expected && hits[i].met());
    EXPECT_EQ(hits[i].triangle, expected->triangle);
    EXPECT_NEAR(hits[i].range_mm, expected->range_mm, 1e-11);
  }
}

TEST(Raycaster, HitsLieOnTheMesh) {
  const TriangleMesh mesh = folded_mesh(6);
  const Raycaster raycaster(mesh);
  const ClosestPoint closest(mesh);
  const Vec3 origin(3.0, -4.0, 5.0);
  constexpr double kOnTheMesh_mm = 1e-4;
  for (const Vec3& ray : directions(2000)) {
    const Hit hit = raycaster.intersect(origin, ray);
    ASSERT_TRUE(hit.met());
    EXPECT_TRUE(closest(origin + hit.range_mm * ray).distance_mm <= kOnTheMesh_mm);
    const Vec3i& t = mesh.triangles[hit.triangle];
    const Vec3 from_corners = (1.0 - hit.b1 - hit.b2) * mesh.vertices[t[0]] +
                              hit.b1 * mesh.vertices[t[1]] + hit.b2 * mesh.vertices[t[2]];
    EXPECT_TRUE((from_corners - (origin + hit.range_mm * ray)).norm() <= kOnTheMesh_mm);
  }
}

// Far from zero, single precision alone would be off by 1e-4 mm.
TEST(Raycaster, KeepsItsPrecisionFarFromTheOrigin) {
  TriangleMesh mesh = folded_mesh(4);
  const TriangleMesh near = mesh;
  const Vec3 offset(16384.0, -8192.0, 4096.0);  // exact in double precision
  for (Vec3& v : mesh.vertices) v += offset;
  const Raycaster far_caster(mesh), near_caster(near);
  for (const Vec3& ray : directions(500)) {
    const Hit a = far_caster.intersect(offset, ray), b = near_caster.intersect(Vec3::Zero(), ray);
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_NEAR(a.range_mm, b.range_mm, 1e-9);
  }
}

// Through corners and edges: always met, and the lowest of the equally near triangles is taken.
TEST(Raycaster, NoRaySlipsThroughCornersAndEdges) {
  const TriangleMesh mesh = test::sphere_mesh(4, 20.0);
  const Raycaster raycaster(mesh);
  const Vec3 origin(0.7, -1.1, 2.3);
  std::vector<int> lowest(mesh.vertices.size(), std::numeric_limits<int>::max());
  for (int t = static_cast<int>(mesh.triangles.size()) - 1; t >= 0; --t)
    for (int k = 0; k < 3; ++k) lowest[mesh.triangles[t][k]] = t;
  int corners_exact = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3 to = mesh.vertices[v] - origin;
    const Hit hit = raycaster.intersect(origin, to.normalized());
    ASSERT_TRUE(hit.met());
    EXPECT_NEAR(hit.range_mm, to.norm(), 1e-10);
    corners_exact += hit.triangle == lowest[v];
  }
  // The normalised direction misses the corner by its rounding, so not every one is a tie.
  EXPECT_GT(corners_exact, 0);
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vec3 to = 0.5 * (mesh.vertices[t[k]] + mesh.vertices[t[(k + 1) % 3]]) - origin;
      const Hit hit = raycaster.intersect(origin, to.normalized());
      ASSERT_TRUE(hit.met());
      EXPECT_NEAR(hit.range_mm, to.norm(), 1e-10);
    }
}

// Rays aimed at edges and corners, where instruction sets round to different neighbours.
TEST(Raycaster, InstructionSetsAgree) {
  const TriangleMesh mesh = folded_mesh(5);
  const Vec3 origin(0.7, -1.1, 2.3);
  std::vector<Vec3> rays = directions(4000);
  for (const Vec3i& t : mesh.triangles) {
    rays.push_back((mesh.vertices[t[0]] - origin).normalized());
    rays.push_back((0.3 * mesh.vertices[t[0]] + 0.7 * mesh.vertices[t[1]] - origin).normalized());
  }
  std::vector<Hit> reference(rays.size());
  const Raycaster plain(mesh, "isa=sse2");
  EXPECT_EQ(plain.packet_size(), 4);
  plain.intersect(origin, rays, reference);
  for (const char* isa : {"isa=sse4.2", "isa=avx", "isa=avx2", "isa=avx512"}) {
    std::vector<Hit> hits(rays.size());
    try {
      Raycaster(mesh, isa).intersect(origin, rays, hits);
    } catch (const Error&) {
      continue;  // this processor does not have it
    }
    int different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i)
      different += hits[i].triangle != reference[i].triangle ||
                   hits[i].range_mm != reference[i].range_mm || hits[i].b1 != reference[i].b1 ||
                   hits[i].b2 != reference[i].b2;
    EXPECT_EQ(different, 0) << isa;
  }
}

TEST(Raycaster, HiddenPointsAreThoseBehindOtherWall) {
  const TriangleMesh mesh = folded_mesh(3);
  const Raycaster raycaster(mesh);
  const Vec3 eye(-6.0, 7.0, 4.0), from(3.0, -4.0, 5.0);
  const auto rays = directions(1500);
  std::vector<Vec3> points;
  for (const Vec3& ray : rays)
    points.push_back(from + raycaster.intersect(from, ray).range_mm * ray);
  std::vector<std::uint8_t> wanted(points.size(), 1), hidden(points.size(), 7);
  wanted[3] = 0;
  raycaster.hidden_from(eye, points, wanted, hidden);
  int found = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double range_mm = (points[i] - eye).norm();
    const auto nearest = brute_force(mesh, eye, (points[i] - eye) / range_mm);
    ASSERT_TRUE(nearest);
    const double short_of_mm = range_mm - nearest->range_mm;
    if (i == 3) {
      EXPECT_EQ(hidden[i], 0);
    } else if (short_of_mm < 1e-6 || short_of_mm > 2e-3 * range_mm) {  // not at the very outline
      EXPECT_EQ(hidden[i] != 0, short_of_mm > 1e-6) << i;
      found += hidden[i];
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_LT(found, 1400);
}

// The traversal's wall is somewhat thicker: a ray that grazes it comes to that one many triangles
// before the true one.
TEST(Raycaster, GrazingRaysMeetTheWallWhereItIs) {
  const TriangleMesh plane = test::plane_mesh(5.0, 8.0, 320);  // at z = 5 mm, 0.05 mm wide cells
  const Raycaster raycaster(plane);
  for (int i = 0; i < 200; ++i) {
    const Vec3 at(2.0 + 0.003 * i, 0.017 * i - 1.5, 5.0);
    for (const double sine : {1e-3, 1e-4, 2e-5}) {
      const Vec3 ray = Vec3(1.0, 0.1, sine).normalized();
      const Hit hit = raycaster.intersect(at - 5.0 * ray, ray);
      ASSERT_TRUE(hit.met()) << i << ' ' << sine;
      EXPECT_NEAR(hit.range_mm, 5.0, 1e-9) << sine;
    }
  }
}

TEST(Raycaster, MissesAndZeroDirectionsMeetNothing) {
  const TriangleMesh plane = test::plane_mesh(10.0, 5.0, 2);
  const Raycaster raycaster(plane);
  EXPECT_TRUE(raycaster.intersect(Vec3::Zero(), Vec3::UnitZ()).met());
  EXPECT_FALSE(raycaster.intersect(Vec3::Zero(), -Vec3::UnitZ()).met());
  EXPECT_FALSE(raycaster.intersect(Vec3::Zero(), Vec3::Zero()).met());
}

TEST(Raycaster, ServesManyThreads) {
  const TriangleMesh mesh = folded_mesh(4);
  const Raycaster raycaster(mesh);
  const auto rays = directions(6400);
  std::vector<Hit> one(rays.size()), many(rays.size());
  raycaster.intersect(Vec3::Zero(), rays, one);
  tbb::parallel_for(0, 100, [&](int i) {
    raycaster.intersect(Vec3::Zero(), std::span(rays).subspan(64 * i, 64),
                        std::span(many).subspan(64 * i, 64));
  });
  for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(one[i].range_mm, many[i].range_mm);
}

TEST(Raycaster, RefusesAMeshWithoutTriangles) { EXPECT_THROW(Raycaster(TriangleMesh{}), Error); }

}  // namespace
}  // namespace rugae
