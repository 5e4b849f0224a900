#include "validate/visibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/check.h"
#include "core/units.h"
#include "tests/validate/shapes.h"

namespace rugae {
namespace {

// 90 degrees across, 100 x 100 px.
Lens lens_90() {
  Lens lens;
  lens.width = lens.height = 100;
  lens.fx = lens.fy = 50.0;
  lens.cx = lens.cy = 50.0;
  return lens;
}

RowPoses turned(double angle_rad, const Vec3& axis) {
  return RowPoses(Rigid3{Quat(Eigen::AngleAxisd(angle_rad, axis)), Vec3::Zero()});
}

// The plane 40 x 40 mm at z = 10, the camera at its middle looking along +z: sees 20 x 20 mm.
struct PlaneView {
  TriangleMesh wall = shapes::plane(40, 40, 0.5, 10.0);
  RowPoses camera{Rigid3{Quat::Identity(), Vec3(20, 20, 0)}};
  cv::Mat depth{100, 100, CV_32F, cv::Scalar(10.0)};
};

TEST(Visibility, ThePlaneInTheFrustumIsSeen) {
  const PlaneView view;
  Visibility visibility(view.wall, {});
  visibility.add(lens_90(), view.camera, view.depth);
  EXPECT_NEAR(area_mm2(visibility.seen_wall()), 400.0, 1e-9);
  EXPECT_NEAR(visibility.covered_area_mm2(1), 400.0, 1e-9);
  EXPECT_EQ(visibility.covered_area_mm2(2), 0.0);
  EXPECT_NEAR(visibility.wall_area_mm2(), 1600.0, 1e-9);
  visibility.add(lens_90(), view.camera, view.depth);
  EXPECT_NEAR(visibility.covered_area_mm2(2), 400.0, 1e-9);
}

TEST(Visibility, WhatLiesBehindANearerSurfaceIsNot) {
  PlaneView view;
  view.depth.colRange(0, 50).setTo(5.0);  // something at 5 mm covers the left half
  Visibility visibility(view.wall, {});
  visibility.add(lens_90(), view.camera, view.depth);
  // The four pixels around the border column still see the plane: half a pixel, 0.1 mm.
  EXPECT_NEAR(area_mm2(visibility.seen_wall()), 200.0, 20 * 0.5);
  view.depth.setTo(std::numeric_limits<float>::quiet_NaN());
  Visibility nothing(view.wall, {});
  nothing.add(lens_90(), view.camera, view.depth);
  EXPECT_TRUE(nothing.seen_wall().empty());
}

TEST(Visibility, FlatViewsAreSeenButNotWell) {
  const PlaneView view;
  // Incidence at a point of the plane is atan(distance from the axis / 10): 30 degrees at 5.77 mm.
  const double radius_mm = 10.0 * std::tan(rad_from_deg(30));
  Visibility visibility(view.wall, {.max_incidence_rad = rad_from_deg(30)});
  visibility.add(lens_90(), view.camera, view.depth);
  EXPECT_NEAR(area_mm2(visibility.seen_wall()), 400.0, 1e-9);
  const double border = 2.0 * kPi * radius_mm * 0.25;  // half a cell along the circle
  EXPECT_NEAR(visibility.covered_area_mm2(1), kPi * radius_mm * radius_mm, border);
}

TEST(Visibility, InsideASphereSixViewsSeeAll) {
  const TriangleMesh wall = shapes::sphere(30, 60);
  cv::Mat depth(100, 100, CV_32F);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x)
      depth.at<float>(y, x) =
          static_cast<float>(30.0 / std::hypot((x - 49.5) / 50.0, (y - 49.5) / 50.0, 1.0));
  Visibility visibility(wall, {});
  for (int k = 0; k < 4; ++k) visibility.add(lens_90(), turned(k * kPi / 2, Vec3::UnitY()), depth);
  for (const double angle : {kPi / 2, -kPi / 2})
    visibility.add(lens_90(), turned(angle, Vec3::UnitX()), depth);
  EXPECT_NEAR(area_mm2(visibility.seen_wall()), visibility.wall_area_mm2(), 1e-6);
}

// Nothing is where it is at rest: what is seen is what is in the frustum then.
TEST(Visibility, AWallThatMovedIsSeenWhereItIs) {
  const PlaneView view;
  Visibility visibility(view.wall, {});
  TriangleMesh moved = view.wall;
  for (Vec3& v : moved.vertices) v += Vec3(5.0, 0.0, 0.0);
  visibility.add(lens_90(), view.camera, view.depth, moved);
  const TriangleMesh seen = visibility.seen_wall();
  EXPECT_NEAR(area_mm2(seen), 400.0, 1e-9);
  double least = 1e9, most = -1e9;
  for (const Vec3i& triangle : seen.triangles)
    for (const int corner : triangle) {
      least = std::min(least, seen.vertices[static_cast<std::size_t>(corner)].x());
      most = std::max(most, seen.vertices[static_cast<std::size_t>(corner)].x());
    }
  EXPECT_NEAR(least, 10.0, 1e-9);
  EXPECT_NEAR(most, 30.0, 1e-9);
}

// Seen twice, 2 mm apart, the place between; what one frame alone saw, as that one saw it; nobody
// saw the rest, which stays.
TEST(Visibility, TheWallSeenIsWhereItWasOnAverage) {
  const PlaneView view;
  Visibility visibility(view.wall, {});
  TriangleMesh moved = view.wall;
  for (Vec3& v : moved.vertices) v.z() += 2.0;
  cv::Mat farther = view.depth + 2.0;
  farther.colRange(0, 50) = 5.0;  // hides the left half
  visibility.add(lens_90(), view.camera, view.depth, view.wall);
  visibility.add(lens_90(), view.camera, farther, moved);
  const TriangleMesh seen = visibility.seen_wall();
  const auto height_at = [&](double x, double y) {
    for (std::size_t v = 0; v < seen.vertices.size(); ++v)
      if ((view.wall.vertices[v] - Vec3(x, y, 10.0)).norm() < 1e-9) return seen.vertices[v].z();
    return 0.0;
  };
  EXPECT_NEAR(height_at(15.0, 20.0), 10.0, 1e-9);
  EXPECT_NEAR(height_at(25.0, 20.0), 11.0, 1e-9);
  EXPECT_NEAR(height_at(2.0, 20.0), 10.0, 1e-9);
  EXPECT_TRUE(seen.normals.empty());
}

// The camera slides by 4 mm along x from the first row to the last: a row of the plane is seen
// where the camera is then.
TEST(Visibility, ARollingShutterSeesEachRowFromWhereItWasThen) {
  const PlaneView view;
  const Lens lens = lens_90();
  std::vector<Rigid3> rows;
  for (int row = -1; row <= lens.height; ++row)
    rows.push_back({Quat::Identity(), Vec3(20.0 + 4.0 * ((row + 0.5) / lens.height - 0.5), 20, 0)});
  Visibility visibility(view.wall, {});
  visibility.add(lens, RowPoses(rows, 1e-4), view.depth);
  const double across_mm = 20.0;
  for (std::size_t t = 0; t < view.wall.triangles.size(); ++t) {
    const Vec3i& i = view.wall.triangles[t];
    const Vec3 centre =
        (view.wall.vertices[i[0]] + view.wall.vertices[i[1]] + view.wall.vertices[i[2]]) / 3.0;
    const double down = (centre.y() - 10.0) / across_mm;  // of the image's height
    const double middle_mm = 20.0 + 4.0 * (down - 0.5);
    const bool inside = down > 0.0 && down < 1.0 && std::abs(centre.x() - middle_mm) < 10.0;
    ASSERT_EQ(visibility.seen()[t], inside ? 1u : 0u) << centre.transpose();
  }
}

TEST(Visibility, WrongSizesAndOptionsAreErrors) {
  const PlaneView view;
  Visibility visibility(view.wall, {});
  EXPECT_THROW(visibility.add(lens_90(), RowPoses(), cv::Mat(10, 10, CV_32F)), Error);
  EXPECT_THROW(Visibility(view.wall, {.max_incidence_rad = 2.0}), Error);
}

}  // namespace
}  // namespace rugae
