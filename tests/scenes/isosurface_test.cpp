#include "scenes/isosurface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/check.h"
#include "scenes/cell_sheets.h"
#include "scenes/lattice_noise.h"

namespace rugae {
namespace {

Eigen::AlignedBox3d cube(double half_mm) {
  return {Vec3::Constant(-half_mm), Vec3::Constant(half_mm)};
}

double sphere(const Vec3& p, double radius_mm, Vec3* gradient) {
  if (gradient) *gradient = p.normalized();
  return p.norm() - radius_mm;
}

TEST(Isosurface, ASphereIsASphere) {
  const TriangleMesh mesh = isosurface([](const Vec3& p, Vec3* g) { return sphere(p, 10.0, g); },
                                       cube(10.0), 0.5, 4, "sphere");
  const EdgeReport edges = inspect_edges(mesh);
  EXPECT_TRUE(edges.closed());
  EXPECT_EQ(edges.flipped, 0u);
  for (const Vec3& v : mesh.vertices) EXPECT_NEAR(v.norm(), 10.0, 1e-9);
  // chords of 0.5 mm lie under the arc by 0.5^2 / (8 * 10) mm: 0.1 % of the volume
  EXPECT_NEAR(signed_volume_mm3(mesh) / (4.0 / 3.0 * M_PI * 1000.0), 1.0, 2e-3);
}

TEST(Isosurface, IsClosedAndManifoldHoweverRaggedTheField) {
  // a ball of noise with features down to a cell: sheets meet in every way
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const DistanceField field = [seed](const Vec3& p, Vec3* g) {
      const double noise = gradient_noise(p / 1.7, seed).value;
      const double ball = sphere(p, 8.0, nullptr);
      if (g) *g = Vec3::Zero();  // no Newton steps: the topology is judged alone
      return std::max(ball, 0.3 * noise);
    };
    const TriangleMesh mesh = isosurface(field, cube(8.0), 0.8, 0, "noise");
    const EdgeReport edges = inspect_edges(mesh);
    EXPECT_EQ(edges.open, 0u) << seed;
    EXPECT_EQ(edges.non_manifold, 0u) << seed;
    EXPECT_EQ(edges.flipped, 0u) << seed;
    EXPECT_GT(mesh.triangles.size(), 2000u);
  }
}

TEST(Isosurface, NothingToFindIsAnError) {
  try {
    isosurface(
        [](const Vec3&, Vec3* g) {
          if (g) *g = Vec3::UnitX();
          return 5.0;
        },
        cube(2.0), 0.5, 1, "empty");
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "empty: no wall found at a cell of 0.5 mm");
  }
}

TEST(CellSheets, AreClosedLoopsOfCutEdges) {
  for (int mask = 0; mask < 256; ++mask)
    for (int flip = 0; flip < 64; flip += 21) {  // none, and two patterns of inverted faces
      const auto inside = static_cast<CornerMask>(mask);
      const CellSheets sheets = cell_sheets(inside, static_cast<FaceMask>(flip));
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 4; ++side) {
          const int low = (side & 1) << (axis + 1) % 3 | (side >> 1) << (axis + 2) % 3;
          const bool cut = (mask >> low & 1) != (mask >> (low | 1 << axis) & 1);
          const int sheet = sheets.of_edge[4 * axis + side];
          EXPECT_EQ(sheet >= 0, cut);
          EXPECT_LT(sheet, sheets.count);
        }
      // a loop around a corner needs three edges, so there are at most four
      EXPECT_LE(sheets.count, 4);
      EXPECT_EQ(sheets.count == 0, mask == 0 || mask == 255);
    }
  EXPECT_EQ(cell_sheets(0b10000001, 0).count, 2);         // two corners at a diagonal's ends
  EXPECT_EQ(cell_sheets(0b00001001, 0).count, 2);         // across a face: apart,
  EXPECT_EQ(cell_sheets(0b00001001, 0b010000).count, 1);  // or joined on the face z = 0
  EXPECT_EQ(ambiguous_faces(0b00001001), 0b010000);
  EXPECT_EQ(ambiguous_faces(0b10000001), 0);
}

}  // namespace
}  // namespace rugae
