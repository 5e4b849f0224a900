#include "studies/simplify.h"

#include <gtest/gtest.h>

#include "tests/validate/shapes.h"

namespace rugae {
namespace {

TEST(Simplify, ASphereStaysOne) {
  constexpr double kRadius_mm = 40.0;
  const TriangleMesh full = shapes::sphere(kRadius_mm, 60);
  const TriangleMesh few = simplified(full, 1500);
  ASSERT_LE(few.triangles.size(), 1500u);
  ASSERT_GE(few.triangles.size(), 1400u);
  // A triangle of 2 A / n of the sphere's area has sides near a = sqrt(4 A / (n sqrt 3)); its
  // middle lies a^2 / (6 R) below the sphere: 0.4 mm here. Vertices are placed between that and the
  // sphere.
  for (const Vec3& v : few.vertices) ASSERT_NEAR(v.norm(), kRadius_mm, 0.4);
  EXPECT_TRUE(inspect_edges(few).closed());
  EXPECT_NEAR(signed_volume_mm3(few) / signed_volume_mm3(full), 1.0, 0.01);
}

TEST(Simplify, ASmallMeshKeepsItsGeometry) {
  const TriangleMesh full = shapes::sphere(40.0, 10);
  const TriangleMesh same = simplified(full, full.triangles.size());
  EXPECT_EQ(same.vertices, full.vertices);
  EXPECT_EQ(same.triangles.size(), full.triangles.size());
}

}  // namespace
}  // namespace rugae
