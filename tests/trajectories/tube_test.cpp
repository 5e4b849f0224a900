#include "trajectories/tube.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "core/units.h"
#include "tests/trajectories/cavities.h"

namespace rugae {
namespace {

TEST(FreeSpace, KnowsAnEllipsoid) {
  const Vec3 center(10.0, -20.0, 30.0);
  const TriangleMesh wall = ellipsoid({60.0, 40.0, 40.0}, center);
  const FreeSpace space(wall);
  constexpr double kFacetMm = 0.3;  // flat triangles cut up to so much off the round wall
  EXPECT_NEAR(space.depth_mm(center), 40.0, kFacetMm);
  EXPECT_NEAR(space.depth_mm(center + Vec3(70.0, 0.0, 0.0)), -10.0, kFacetMm);
  EXPECT_NEAR(space.widest_mm(), 40.0, 4.0);  // a step of the grid
  EXPECT_LE((space.widest_point() - center).norm(), 6.0);
  // The closest triangle's normal leans by its size over the radius of curvature, 40^2 / 60 mm.
  constexpr double kLean = 0.15;
  EXPECT_LE((space.away_from_wall(center + Vec3(50.0, 0.0, 0.0)) + Vec3::UnitX()).norm(), kLean);
  EXPECT_LE((space.away_from_wall(center + Vec3(70.0, 0.0, 0.0)) + Vec3::UnitX()).norm(), kLean);
}

TEST(FreeSpace, MedialLineFollowsABentTube) {
  constexpr double kTubeMm = 20.0, kArcMm = 75.0, kDepthMm = 16.0;
  const TriangleMesh wall = bent_tube(kTubeMm, kArcMm, rad_from_deg(110.0));
  const FreeSpace space(wall);
  const auto line = space.medial_line(kDepthMm, 67);
  double length = 0.0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    EXPECT_GE(space.depth_mm(line[i]), kDepthMm - 0.5);
    EXPECT_LE(std::abs(line[i].z()), 3.0);
    if (i) length += (line[i] - line[i - 1]).norm();
  }
  // Of the arc of 144 mm, the space as deep as that reaches to within a few mm beyond both ends;
  // a line inside it may cut the bend by 4 mm.
  EXPECT_NEAR(length, kArcMm * rad_from_deg(110.0), 10.0);
}

TEST(Tube, EveryPointIsInside) {
  constexpr double kKeepMm = 6.0;
  constexpr double kBetweenStationsMm = 1.0;  // the wall is looked at at stations alone
  for (const TriangleMesh& wall : {test_ellipsoid(), test_tube()}) {
    const FreeSpace space(wall);
    const Tube tube(space, space.medial_line(9.0, 67), kKeepMm);
    double widest = 0.0;
    for (int i = 0; i < 3000; ++i) {
      const auto u = random_uniform(4, Purpose::test, 0, i);
      const double r = 200.0 * u[1] * u[1], angle = 2.0 * kPi * u[2];
      const Vec3 p =
          tube.point(u[0] * tube.length_mm(), {r * std::cos(angle), r * std::sin(angle)});
      EXPECT_GE(space.depth_mm(p), kKeepMm - kBetweenStationsMm);
      widest = std::max(widest, (p - tube.point(u[0] * tube.length_mm(), {0.0, 0.0})).norm());
    }
    EXPECT_GE(widest, 20.0);  // and the tube is not a thread
  }
}

TEST(Tube, NearTheAxisPlacesAreTakenAsGiven) {
  const TriangleMesh wall = test_tube();
  const FreeSpace space(wall);
  const Tube tube(space, space.medial_line(9.0, 67), 6.0);
  const double along = 0.4 * tube.length_mm();
  const Vec3 axis = tube.point(along, {0.0, 0.0});
  const Vec3 beside = tube.point(along, {1.0, -2.0});
  EXPECT_LE((tube.frame(along).conjugate() * (beside - axis) - Vec3(1.0, -2.0, 0.0)).norm(), 1e-3);
}

}  // namespace
}  // namespace rugae
