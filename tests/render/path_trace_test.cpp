// Light between walls against closed forms.
#include "render/path_trace.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <opencv2/core.hpp>

#include "render/frame.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

using test::constant_material;
using test::lambert;
using test::small_camera;

const Rigid3 kAtOrigin;
constexpr double kRadius_mm = 25.0;

cv::Mat radiance_of(const TriangleMesh& wall, const MucosaSample& material, const Camera& camera,
                    const PathOptions& paths, const Rigid3& pose = kAtOrigin, int index = 0) {
  const FrameRenderer renderer(Surface(wall, constant_material(material)), camera,
                               {.vignetting = false, .labels = LabelSet::none(), .paths = paths});
  return renderer.render(pose, nullptr, nullptr, index).radiance;
}

double mean_of(const cv::Mat& image) { return cv::mean(image)[1]; }

// The mean over the pixels and the standard error of it, from the scatter between them: only where
// all pixels have the same mean.
struct Estimate {
  double mean, error;
};
Estimate estimate_of(const cv::Mat& image) {
  cv::Mat green;
  cv::extractChannel(image, green, 1);
  cv::Scalar mean, deviation;
  cv::meanStdDev(green, mean, deviation);
  return {mean[0], deviation[0] / std::sqrt(static_cast<double>(green.total()))};
}

// A light in the middle of a Lambertian sphere: every place gets E = I / R^2 straight, sends
// rho E / pi, and gets back rho times what the whole sphere sends, bounce after bounce:
//   L_k = rho I / (pi R^2) sum_{j=0..k} rho^j,   L = rho I / (pi R^2 (1 - rho)).
TEST(PathTrace, LambertianSphereBounceByBounce) {
  const TriangleMesh sphere = test::sphere_mesh(6, kRadius_mm);
  const Camera camera = small_camera(16, 12);
  constexpr double kAlbedo = 0.6;
  const double direct = kAlbedo / (kPi * kRadius_mm * kRadius_mm);
  double expected = direct, power = 1.0;
  for (int bounces = 1; bounces <= 4; ++bounces) {
    power *= kAlbedo;
    expected += direct * power;
    const double found = mean_of(radiance_of(
        sphere, lambert(kAlbedo), camera, {.bounces = bounces, .samples = 4, .roulette = false}));
    // Every path carries the same in a true sphere; its facets lie up to 7e-5 R inside.
    EXPECT_NEAR(found / expected, 1.0, 3e-4) << bounces;
  }
}

TEST(PathTrace, LambertianSphereConverges) {
  const TriangleMesh sphere = test::sphere_mesh(5, kRadius_mm);
  const auto expected = [](double albedo) {
    return albedo / (kPi * kRadius_mm * kRadius_mm * (1.0 - albedo));
  };
  // Without the roulette every path carries the same; 0.85^65 = 2.6e-5 is left after 64 bounces,
  // and the facets lie up to 3e-4 R inside the sphere.
  for (double albedo : {0.3, 0.85}) {
    const double found =
        mean_of(radiance_of(sphere, lambert(static_cast<float>(albedo)), small_camera(16, 12),
                            {.bounces = 64, .samples = 2, .roulette = false}));
    EXPECT_NEAR(found / expected(albedo), 1.0, 0.002) << albedo;
  }
  const Estimate found = estimate_of(
      radiance_of(sphere, lambert(0.6f), small_camera(16, 12), {.bounces = 64, .samples = 1024}));
  EXPECT_TRUE(found.error <= 0.0012 * expected(0.6)) << found.error / expected(0.6);
  EXPECT_TRUE(std::abs(found.mean - expected(0.6)) <= 0.005 * expected(0.6))
      << found.mean / expected(0.6);
}

// The roulette changes the noise, not the mean: both agree within their errors, in a cavity with
// shadows and a wet layer. Seeds make independent pictures.
TEST(PathTrace, RouletteIsUnbiased) {
  const TriangleMesh wall = test::folded_mesh(4);
  MucosaSample wet = lambert(0.7f);
  wet.coverage = 0.8f;
  wet.roughness = 0.3f;
  wet.f0 = 0.1f;
  const Camera camera = small_camera(16, 12);
  constexpr int kPictures = 16;
  const auto estimate = [&](bool roulette) {
    double sum = 0.0, sum2 = 0.0;
    for (int i = 0; i < kPictures; ++i) {
      const double mean = mean_of(radiance_of(wall, wet, camera,
                                              {.bounces = 12,
                                               .samples = 8,
                                               .roulette = roulette,
                                               .seed = static_cast<std::uint64_t>(i + 1)}));
      sum += mean;
      sum2 += mean * mean;
    }
    const double mean = sum / kPictures;
    return Estimate{mean, std::sqrt((sum2 / kPictures - mean * mean) / (kPictures - 1))};
  };
  const Estimate with = estimate(true), without = estimate(false);
  const double error = std::hypot(with.error, without.error);
  EXPECT_TRUE(error <= 0.005 * without.mean) << error / without.mean;
  EXPECT_TRUE(std::abs(with.mean - without.mean) <= 4.0 * error)
      << with.mean << " " << without.mean << " +- " << error;
}

// A light beside the middle: one bounce is
//   L1(x) = rho / pi * integral over the wall of L0(y) cos_x cos_y / |x - y|^2 dA(y),
// and within a sphere cos_x cos_y / |x - y|^2 = 1 / (4 R^2) for every pair, so L1 is the same
// everywhere: rho times the mean of L0 = rho E / pi, with E by the midpoint rule.
TEST(PathTrace, OneBounceOfALightBesideTheMiddle) {
  const TriangleMesh sphere = test::sphere_mesh(6, kRadius_mm);
  Camera camera = small_camera(16, 12);
  camera.lights = {{Vec3(0.0, 6.0, -9.0), Vec3(0.0, 0.6, 0.8), 2.0, 1.3}};
  const Emitter& light = camera.lights[0];
  constexpr double kAlbedo = 0.5;
  double sum = 0.0;
  constexpr int kRings = 400, kSectors = 400;
  for (int i = 0; i < kRings; ++i)
    for (int k = 0; k < kSectors; ++k) {
      const double z = 2.0 * (i + 0.5) / kRings - 1.0, s = std::sqrt(1.0 - z * z);
      const double a = 2.0 * kPi * (k + 0.5) / kSectors;
      const Vec3 n(s * std::cos(a), s * std::sin(a), z), path = kRadius_mm * n - light.offset_mm;
      const double d = path.norm();
      sum += light.intensity * std::exp(-light.lobe * (1.0 - light.axis.dot(path) / d)) *
             n.dot(path) / (d * d * d);
    }
  const double expected = kAlbedo * kAlbedo / kPi * sum / (kRings * kSectors);
  const PathOptions one{.bounces = 1, .samples = 256}, none{};
  const Estimate found = estimate_of(radiance_of(sphere, lambert(kAlbedo), camera, one) -
                                     radiance_of(sphere, lambert(kAlbedo), camera, none));
  EXPECT_TRUE(found.error <= 0.002 * expected) << found.error / expected;
  EXPECT_NEAR(found.mean / expected, 1.0, 0.005);
}

// A closed cavity of any reflection never shines brighter than one that absorbs nothing would: with
// a white wall under a coat, each bounce carries at most what the one before did.
TEST(PathTrace, EveryBounceCarriesLess) {
  const TriangleMesh sphere = test::sphere_mesh(5, kRadius_mm);
  MucosaSample wet = lambert(0.95f);
  wet.coverage = 1.0f;
  wet.roughness = 0.4f;
  wet.f0 = 0.2f;
  double last = 1e300, sum = 0.0;
  for (int bounces = 1; bounces <= 6; ++bounces) {
    const double all = mean_of(radiance_of(sphere, wet, small_camera(16, 12),
                                           {.bounces = bounces, .samples = 64, .roulette = false}));
    if (bounces > 1) {
      const double added = all - sum;
      EXPECT_TRUE(added > 0.0);
      EXPECT_TRUE(added <= last * 1.01) << bounces;  // 1 %: noise of the mean
      last = added;
    }
    sum = all;
  }
}

TEST(PathTrace, TheSameBytesForAnyThreadsAndOthersForAnotherFrame) {
  const TriangleMesh wall = test::folded_mesh(4);
  MucosaSample wet = lambert(0.6f);
  wet.coverage = 0.5f;
  const PathOptions options{.bounces = 3, .samples = 3};
  const auto render = [&](int threads, int index) {
    cv::Mat image;
    tbb::task_arena(threads).execute(
        [&] { image = radiance_of(wall, wet, small_camera(), options, kAtOrigin, index); });
    return image;
  };
  const cv::Mat one = render(1, 0), two = render(2, 0), other = render(2, 1);
  EXPECT_EQ(cv::norm(one, two, cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(one, other, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace rugae
