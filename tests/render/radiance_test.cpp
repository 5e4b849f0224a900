#include "render/radiance.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "render/bsdf.h"
#include "render/frame.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

using test::constant_material;
using test::lambert;
using test::small_camera;

const Rigid3 kAtOrigin;

cv::Mat radiance_of(const TriangleMesh& wall, const MucosaSample& material, const Camera& camera,
                    const Rigid3& pose = kAtOrigin, bool vignetting = false) {
  const FrameRenderer renderer(Surface(wall, constant_material(material)), camera,
                               {vignetting, false});
  return renderer.render(pose, nullptr).radiance;
}

Vec3f at(const cv::Mat& image, int x, int y) { return image.ptr<Vec3f>(y)[x]; }

// Light in the middle of a sphere meets the wall head-on everywhere: L = albedo I / (pi R^2).
TEST(Radiance, LightInASphere) {
  constexpr double kRadius_mm = 25.0;
  constexpr float kAlbedo = 0.37f;
  // Seven levels: the facets lie at most 1.7e-5 of the radius inside the sphere.
  const cv::Mat image =
      radiance_of(test::sphere_mesh(7, kRadius_mm), lambert(kAlbedo), small_camera());
  const double expected = kAlbedo / (kPi * kRadius_mm * kRadius_mm);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(at(image, x, y)[c] / expected, 1.0, 1e-4) << x << " " << y;
}

// On a plane at distance z a point under the angle theta lies at z / cos(theta) and is tilted by
// theta: L = albedo I cos^3(theta) / (pi z^2).
TEST(Radiance, InverseSquareAndCosineLaws) {
  const Camera camera = small_camera();
  for (double z_mm : {10.0, 20.0, 80.0}) {
    const cv::Mat image =
        radiance_of(test::plane_mesh(z_mm, 40.0 * z_mm, 4), lambert(0.5f), camera);
    for (int y = 0; y < image.rows; y += 3)
      for (int x = 0; x < image.cols; x += 3) {
        const auto ray = camera.lens.unproject({x + 0.5, y + 0.5});
        const double cosine = ray->z();
        const double expected = 0.5 * cosine * cosine * cosine / (kPi * z_mm * z_mm);
        ASSERT_NEAR(at(image, x, y)[1] / expected, 1.0, 3e-6);
      }
  }
}

TEST(Radiance, VignettingDarkensByItsOwnLaw) {
  Camera camera = small_camera();
  camera.vignetting = {true, -0.1, -0.05, 0.02};
  const TriangleMesh wall = test::sphere_mesh(4, 25.0);
  const cv::Mat without = radiance_of(wall, lambert(0.5f), camera),
                with = radiance_of(wall, lambert(0.5f), camera, kAtOrigin, true);
  const double half_diagonal = 0.5 * std::hypot(camera.lens.width, camera.lens.height);
  for (int y = 0; y < with.rows; ++y)
    for (int x = 0; x < with.cols; ++x) {
      const auto ray = camera.lens.unproject({x + 0.5, y + 0.5});
      const double r2 =
          (std::pow(x + 0.5 - camera.lens.cx, 2) + std::pow(y + 0.5 - camera.lens.cy, 2)) /
          (half_diagonal * half_diagonal);
      const double expected =
          std::pow(ray->z(), 4) * (1.0 - 0.1 * r2 - 0.05 * r2 * r2 + 0.02 * r2 * r2 * r2);
      ASSERT_NEAR(at(with, x, y)[0] / at(without, x, y)[0], expected, 1e-6);
    }
}

// Light and eye are in one place, so the mirror direction is the wall's normal: the highlight lies
// where the wall is seen head-on, and falls off as D does.
TEST(Radiance, HighlightWhereTheWallFacesTheCamera) {
  MucosaSample wet = lambert(0.0f);
  wet.coverage = 1.0f;
  wet.roughness = 0.15f;
  wet.f0 = 0.02f;
  const Camera camera = small_camera(161, 121);
  const Rigid3 turned(Quat(Eigen::AngleAxisd(0.25, Vec3(0.6, -0.8, 0.0))), Vec3::Zero());
  const cv::Mat image = radiance_of(test::plane_mesh(20.0, 400.0, 4), wet, camera, turned);
  int best_x = 0, best_y = 0;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      if (at(image, x, y)[0] > at(image, best_x, best_y)[0]) {
        best_x = x;
        best_y = y;
      }
  const auto head_on = camera.lens.project(turned.inverse().rotation * Vec3::UnitZ());
  EXPECT_NEAR(best_x + 0.5, head_on->x(), 0.51);
  EXPECT_NEAR(best_y + 0.5, head_on->y(), 0.51);
  const Vec3 ray = turned.rotation * *camera.lens.unproject({best_x + 20.5, best_y + 0.5});
  const Vec3 w(std::sqrt(1.0 - ray.z() * ray.z()), 0.0, ray.z());
  const double range_mm = 20.0 / ray.z();
  const double expected = coat_brdf({0.15f, 1.0, 0.02f}, w, w) * w.z() / (range_mm * range_mm);
  EXPECT_NEAR(at(image, best_x + 20, best_y)[0] / expected, 1.0, 1e-4);
}

// The slope of the wet layer tilts its normal against the gradient: on the plane z = 20 seen from
// below, n = -z, and a slope g along x moves the highlight to where the ray is parallel to
// (g, 0, 1).
TEST(Radiance, CoatGradientMovesTheHighlight) {
  MucosaSample wet = lambert(0.0f);
  wet.coverage = 1.0f;
  wet.roughness = 0.1f;
  wet.coat_gradient = {0.2f, 0.0f, 5.0f};  // the part along the normal does not count
  const Camera camera = small_camera(161, 121);
  const cv::Mat image = radiance_of(test::plane_mesh(20.0, 400.0, 4), wet, camera);
  int best_x = 0, best_y = 0;
  double best = 0.0;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const auto ray = camera.lens.unproject({x + 0.5, y + 0.5});
      const double value = at(image, x, y)[0] / (ray->z() * ray->z());  // without the fall-off
      if (value > best) {
        best = value;
        best_x = x;
        best_y = y;
      }
    }
  const auto expected = camera.lens.project(Vec3(0.2, 0.0, 1.0));
  EXPECT_NEAR(best_x + 0.5, expected->x(), 1.01);
  EXPECT_NEAR(best_y + 0.5, expected->y(), 1.01);
}

// Without highlights a frame is what it is with them, less their part.
TEST(Radiance, HighlightsAreOneSwitch) {
  MucosaSample wet = lambert(0.4f);
  wet.coverage = 1.0f;
  wet.roughness = 0.3f;
  wet.f0 = 0.03f;
  const TriangleMesh sphere = test::sphere_mesh(4, 25.0);
  LabelSet parts = LabelSet::none();
  parts.diffuse = parts.specular = true;
  const auto render = [&](bool highlights, int samples) {
    const FrameRenderer renderer(Surface(sphere, constant_material(wet)), small_camera(),
                                 {.vignetting = false, .labels = parts, .highlights = highlights});
    CleanFrame frame = renderer.render(kAtOrigin, nullptr);
    if (samples > 0) frame.radiance = renderer.gather(FrameView(), {.samples = samples});
    return frame;
  };
  const CleanFrame with = render(true, 0), without = render(false, 0);
  ASSERT_GT(cv::countNonZero(with.truth.specular), 0);
  EXPECT_EQ(cv::countNonZero(without.truth.specular), 0);
  EXPECT_EQ(cv::norm(without.radiance, with.truth.diffuse, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(without.truth.diffuse, with.truth.diffuse, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::countNonZero(without.truth.masks & kMaskSpecular), 0);
  // Gathered from several samples likewise: one through the centre is the sharp frame.
  EXPECT_LT(cv::sum(render(false, 4).radiance)[0], cv::sum(render(true, 4).radiance)[0]);
}

TEST(Radiance, SpecularMaskWhereTheCoatAddsItsShare) {
  MucosaSample wet = lambert(0.3f);
  wet.coverage = 1.0f;
  wet.roughness = 0.15f;
  const TriangleMesh wall = test::plane_mesh(20.0, 400.0, 4);
  const Camera camera = small_camera();
  const FrameRenderer renderer(Surface(wall, constant_material(wet)), camera, {false, false});
  const CleanFrame frame = renderer.render(kAtOrigin, nullptr);
  int specular = 0;
  for (int y = 0; y < frame.radiance.rows; ++y)
    for (int x = 0; x < frame.radiance.cols; ++x) {
      const double cosine = camera.lens.unproject({x + 0.5, y + 0.5})->z();
      const Vec3 w(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
      const Coat coat{wet.roughness, wet.coverage, wet.f0};
      const double share =
          coat_brdf(coat, w, w) / (coat_brdf(coat, w, w) + wall_brdf(coat, 0.3, w, w));
      const unsigned char mask = frame.truth.masks.ptr<unsigned char>(y)[x];
      EXPECT_TRUE(mask & kMaskValid);
      if (std::abs(share - kSpecularShare) > 1e-4) {
        EXPECT_EQ((mask & kMaskSpecular) != 0, share > kSpecularShare);
      }
      specular += (mask & kMaskSpecular) != 0;
    }
  EXPECT_GT(specular, 20);
  EXPECT_LT(specular, frame.radiance.rows * frame.radiance.cols / 2);
}

// Lengths times s: light falls by s^2 and nothing else changes.
TEST(Radiance, ALargerWorldIsOnlyDarker) {
  TriangleMesh wall = test::folded_mesh(4);
  MucosaSample wet = lambert(0.4f);
  wet.coverage = 0.8f;
  const cv::Mat small = radiance_of(wall, wet, small_camera());
  for (Vec3& v : wall.vertices) v *= 4.0;
  const cv::Mat large = radiance_of(wall, wet, small_camera());
  for (int y = 0; y < small.rows; ++y)
    for (int x = 0; x < small.cols; ++x)
      ASSERT_EQ(at(large, x, y)[0] * 16.0f, at(small, x, y)[0]) << x << " " << y;
}

TEST(Radiance, WhereNothingIsMetItIsDark) {
  const Camera camera = small_camera();
  const cv::Mat image = radiance_of(test::plane_mesh(20.0, 3.0, 2), lambert(0.5f), camera);
  EXPECT_EQ(at(image, 1, 1), Vec3f(0.0f, 0.0f, 0.0f));
  EXPECT_GT(at(image, 48, 36)[0], 0.0f);
}

}  // namespace
}  // namespace rugae
