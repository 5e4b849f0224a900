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

// The plane 40 x 40 mm at z = 10, the camera at its middle looking along +z: sees 20 x 20 mm.
struct PlaneView {
  TriangleMesh wall = shapes::plane(40, 40, 0.5, 10.0);
  Rigid3 world_from_camera{Quat::Identity(), Vec3(20, 20, 0)};
  cv::Mat depth{100, 100, CV_32F, cv::Scalar(10.0)};
};

TEST(Visibility, ThePlaneInTheFrustumIsSeen) {
  const PlaneView view;
  Visibility visibility(view.wall, {});
  visibility.add(lens_90(), view.world_from_camera, view.depth);
  EXPECT_NEAR(area_mm2(visibility.seen_wall()), 400.0, 1e-9);
  EXPECT_NEAR(visibility.covered_area_mm2(1), 400.0, 1e-9);
  EXPECT_EQ(visibility.covered_area_mm2(2), 0.0);
  EXPECT_NEAR(visibility.wall_area_mm2(), 1600.0, 1e-9);
  visibility.add(lens_90(), view.world_from_camera, view.depth);
  EXPECT_NEAR(visibility.covered_area_mm2(2), 400.0, 1e-9);
}

TEST(Visibility, WhatLiesBehindANearerSurfaceIsNot) {
  PlaneView view;
  view.depth.colRange(0, 50).setTo(5.0);  // something at 5 mm covers the left half
  Visibility visibility(view.wall, {});
  visibility.add(lens_90(), view.world_from_camera, view.depth);
  // The four pixels around the border column still see the plane: half a pixel, 0.1 mm.
  EXPECT_NEAR(area_mm2(visibility.seen_wall()), 200.0, 20 * 0.5);
  view.depth.setTo(std::numeric_limits<float>::quiet_NaN());
  Visibility nothing(view.wall, {});
  nothing.add(lens_90(), view.world_from_camera, view.depth);
  EXPECT_TRUE(nothing.seen_wall().empty());
}

TEST(Visibility, FlatViewsAreSeenButNotWell) {
  const PlaneView view;
  // Incidence at a point of the plane is atan(distance from the axis / 10): 30 degrees at 5.77 mm.
  const double radius_mm = 10.0 * std::tan(rad_from_deg(30));
  Visibility visibility(view.wall, {.max_incidence_rad = rad_from_deg(30)});
  visibility.add(lens_90(), view.world_from_camera, view.depth);
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
  for (int k = 0; k < 4; ++k)
    visibility.add(lens_90(), {Quat(Eigen::AngleAxisd(k * kPi / 2, Vec3::UnitY())), Vec3::Zero()},
                   depth);
  for (const double angle : {kPi / 2, -kPi / 2})
    visibility.add(lens_90(), {Quat(Eigen::AngleAxisd(angle, Vec3::UnitX())), Vec3::Zero()}, depth);
  EXPECT_NEAR(area_mm2(visibility.seen_wall()), visibility.wall_area_mm2(), 1e-6);
}

TEST(Visibility, WrongSizesAndOptionsAreErrors) {
  const PlaneView view;
  Visibility visibility(view.wall, {});
  EXPECT_THROW(visibility.add(lens_90(), {}, cv::Mat(10, 10, CV_32F)), Error);
  EXPECT_THROW(Visibility(view.wall, {.max_incidence_rad = 2.0}), Error);
}

}  // namespace
}  // namespace rugae
