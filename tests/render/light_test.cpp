// Lights beside the camera: lobe and shadow against closed forms.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "render/frame.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

using test::constant_material;
using test::lambert;
using test::small_camera;

const Rigid3 kAtOrigin;

cv::Mat radiance_of(const TriangleMesh& wall, const MucosaSample& material, const Camera& camera,
                    const Rigid3& pose = kAtOrigin) {
  const FrameRenderer renderer(Surface(wall, constant_material(material)), camera, {false, false});
  return renderer.render(pose, nullptr).radiance;
}

Camera lit_by(const std::vector<Emitter>& lights, int width = 96, int height = 72) {
  Camera camera = small_camera(width, height);
  camera.lights = lights;
  return camera;
}

// On the plane z = 20, lit from b: L = rho I exp(-mu (1 - D . w)) cos(theta) / (pi d^2), summed
// over the lights. The camera is turned and moved: the lights go with it.
TEST(Light, OffsetAndLobeFollowTheClosedForm) {
  const std::vector<Emitter> lights = {
      {Vec3(2.0, -1.0, 0.5), Vec3(0.3, 0.2, 1.0).normalized(), 3.0, 0.7},
      {Vec3(-3.0, 0.5, -1.0), Vec3(-0.1, 0.0, 1.0).normalized(), 0.0, 1.9},
      {Vec3::Zero(), Vec3(0.0, 0.4, 1.0).normalized(), 5.0, 0.4}};
  const Camera camera = lit_by(lights);
  const Rigid3 pose(Quat(Eigen::AngleAxisd(0.4, Vec3(1.0, -0.5, 2.0).normalized())),
                    Vec3(1.0, 2.0, -1.5));
  const double z_mm = 20.0;
  const cv::Mat image = radiance_of(test::plane_mesh(z_mm, 2000.0, 4), lambert(0.5f), camera, pose);
  for (int y = 0; y < image.rows; y += 3)
    for (int x = 0; x < image.cols; x += 3) {
      const Vec3 ray = pose.rotation * *camera.lens.unproject({x + 0.5, y + 0.5});
      ASSERT_GT(ray.z(), 0.1);
      const Vec3 point = pose.translation + (z_mm - pose.translation.z()) / ray.z() * ray;
      double expected = 0.0;
      for (const Emitter& light : lights) {
        const Vec3 path = point - pose * light.offset_mm;
        const double d = path.norm();
        expected += 0.5 / kPi * light.intensity *
                    std::exp(-light.lobe * (1.0 - (pose.rotation * light.axis).dot(path) / d)) *
                    path.z() / (d * d * d);
      }
      // Single precision of the sum and of the wall's normals.
      ASSERT_NEAR(image.ptr<Vec3f>(y)[x][1] / expected, 1.0, 4e-6) << x << " " << y;
    }
}

// A light that is a hair off the centre sees the same wall by another way of computing: with shadow
// rays and the two-direction reflection.
TEST(Light, AHairOffTheCentreIsTheCentralLight) {
  MucosaSample wet = lambert(0.4f);
  wet.coverage = 0.7f;
  wet.roughness = 0.25f;
  wet.coat_gradient = {0.1f, -0.2f, 0.05f};
  const TriangleMesh wall = test::folded_mesh(4);
  const cv::Mat central = radiance_of(wall, wet, lit_by({Emitter{}}));
  const cv::Mat beside =
      radiance_of(wall, wet, lit_by({{Vec3(1e-7, 0.0, 0.0), Vec3::UnitZ(), 0.0, 1.0}}));
  int dark = 0;
  for (int y = 0; y < central.rows; ++y)
    for (int x = 0; x < central.cols; ++x) {
      const Vec3f a = central.ptr<Vec3f>(y)[x], b = beside.ptr<Vec3f>(y)[x];
      if (b.x() == 0.0f && a.x() > 0.0f)
        ++dark;  // walls grazed along a fold
      else
        ASSERT_TRUE((a - b).norm() <= 2e-5f * a.norm()) << x << " " << y;
    }
  EXPECT_TRUE(dark <= central.rows * central.cols / 500) << dark;
}

// A plate with the edge x = e at z = h hides the wall z = Z from a light at b: the shadow's edge
// falls on x = b + (e - b) Z / h. The camera looks past the plate from the other side.
TEST(Light, TheShadowsEdgeFallsWhereItMust) {
  constexpr double kWall_mm = 30.0, kPlate_mm = 12.0, kEdge_mm = -2.0;
  const Vec3 light(-6.0, 0.7, 1.0);
  TriangleMesh world = test::plane_mesh(kWall_mm, 200.0, 8);
  TriangleMesh plate;  // x in [-40, edge], right of which the camera sees the wall
  plate.vertices = {{-4.0, -40.0, kPlate_mm},
                    {kEdge_mm, -40.0, kPlate_mm},
                    {kEdge_mm, 40.0, kPlate_mm},
                    {-4.0, 40.0, kPlate_mm}};
  plate.normals.assign(4, Vec3f(0.0f, 0.0f, 1.0f));
  plate.triangles = {{0, 1, 2}, {0, 2, 3}};
  test::append(world, plate);
  Camera camera = lit_by({{light, Vec3::UnitZ(), 0.0, 1.0}}, 200, 60);
  camera.lens.k1 = camera.lens.k2 = camera.lens.p1 = camera.lens.p2 = 0.0;
  const cv::Mat image = radiance_of(world, lambert(0.5f), camera);

  const auto shadow_of = [&](double x) {
    return light.x() + (x - light.x()) * (kWall_mm - light.z()) / (kPlate_mm - light.z());
  };
  // The camera sees the wall beside the plate; pixels' centres decide, without a penumbra.
  const auto column = [&](double x) { return camera.lens.project(Vec3(x, 0.0, kWall_mm))->x(); };
  const double from = column(shadow_of(-4.0)), to = column(shadow_of(kEdge_mm));
  int in_shadow = 0, in_light = 0;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const double seen = x + 0.5;
      if (seen <= column(kEdge_mm * kWall_mm / kPlate_mm) + 0.01) continue;  // plate or behind it
      const bool dark = image.ptr<Vec3f>(y)[x][0] == 0.0f;
      constexpr double kHundredth_px = 0.01;
      if (seen > from + kHundredth_px && seen < to - kHundredth_px) {
        ++in_shadow;
        ASSERT_TRUE(dark) << x << " " << y;
      } else if (seen < from - kHundredth_px || seen > to + kHundredth_px) {
        ++in_light;
        ASSERT_FALSE(dark) << x << " " << y;
      }
    }
  EXPECT_GT(in_shadow, 500);
  EXPECT_GT(in_light, 2000);
}

// A light behind a wall of one sheet gives nothing to the side that the camera sees.
TEST(Light, NothingShinesThroughTheWall) {
  const cv::Mat image = radiance_of(test::plane_mesh(5.0, 50.0, 2), lambert(0.5f),
                                    lit_by({{Vec3(0.0, 0.0, 9.0), -Vec3::UnitZ(), 0.0, 1.0}}));
  EXPECT_EQ(cv::countNonZero(image.reshape(1)), 0);
}

}  // namespace
}  // namespace rugae
