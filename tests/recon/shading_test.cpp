#include "recon/shading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/random.h"
#include "core/units.h"

namespace rugae {
namespace {

/// The direction to a light in (right, down, towards the viewer).
Vec3 light_direction(double slant, double tilt) {
  return {std::cos(tilt) * std::sin(slant), std::sin(tilt) * std::sin(slant), std::cos(slant)};
}

struct Picture {
  cv::Mat intensity, valid, depth;
};

/// A Lambertian surface of albedo `albedo` whose depth (px, away from the viewer) is given; not
/// valid where the depth is not finite.
Picture render(int size, const std::function<double(double, double)>& depth, const Vec3& light,
               double albedo = 1.0) {
  Picture picture{cv::Mat::zeros(size, size, CV_32F), cv::Mat::zeros(size, size, CV_8U),
                  cv::Mat::zeros(size, size, CV_32F)};
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const double z = depth(x, y);
      constexpr double kStep = 1e-4;
      const double p = (depth(x + kStep, y) - depth(x - kStep, y)) / (2 * kStep);
      const double q = (depth(x, y + kStep) - depth(x, y - kStep)) / (2 * kStep);
      if (!std::isfinite(z + p + q)) continue;
      // Right and down the depth grows with p and q, so the wall faces that way.
      const Vec3 normal = Vec3(p, q, 1.0).normalized();
      picture.intensity.at<float>(y, x) =
          static_cast<float>(albedo * std::max(0.0, normal.dot(light)));
      picture.valid.at<uchar>(y, x) = 255;
      picture.depth.at<float>(y, x) = static_cast<float>(z);
    }
  return picture;
}

/// A cap of a sphere; bulges towards the viewer for `sign` -1, away from the viewer for +1.
std::function<double(double, double)> cap(int size, double radius, double rim, double sign) {
  return [=](double x, double y) {
    const double dx = x - 0.5 * size, dy = y - 0.5 * size, r2 = dx * dx + dy * dy;
    return r2 < rim * rim ? sign * std::sqrt(radius * radius - r2) : std::nan("");
  };
}

double correlation(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  cv::Scalar mean_a, mean_b, deviation_a, deviation_b;
  cv::meanStdDev(a, mean_a, deviation_a, mask);
  cv::meanStdDev(b, mean_b, deviation_b, mask);
  const cv::Mat product = (a - mean_a).mul(b - mean_b);
  return cv::mean(product, mask)[0] / (deviation_a[0] * deviation_b[0]);
}

TEST(Shading, MomentsUnderFrontalLightAreClosedForm) {
  // E[cos b] = integral of cos^2 = pi / 4; E[cos^2 b] = integral of cos^3 = 2 / 3.
  const ShadingMoments moments = shading_moments(0.0);
  constexpr double kMidpointRule = 1e-5;
  EXPECT_NEAR(moments.mean, kPi / 4, kMidpointRule);
  EXPECT_NEAR(moments.rms, std::sqrt(2.0 / 3.0), kMidpointRule);
}

TEST(Shading, MomentsUnderLightFromTheSideAreClosedForm) {
  // I = sin b max(0, cos a): E = (1/2) (1/pi); E[I^2] = (1/3) (1/4).
  const ShadingMoments moments = shading_moments(kPi / 2);
  constexpr double kMidpointRule = 1e-5;
  EXPECT_NEAR(moments.mean, 1.0 / (2.0 * kPi), kMidpointRule);
  EXPECT_NEAR(moments.rms, std::sqrt(1.0 / 12.0), kMidpointRule);
}

TEST(Shading, SlantAndAlbedoOfNormalsOfTheAssumedDistribution) {
  constexpr double kSlant = 0.7, kTilt = -0.4, kAlbedo = 0.6;
  const Vec3 light = light_direction(kSlant, kTilt);
  cv::Mat intensity(400, 400, CV_32F);
  for (int y = 0; y < intensity.rows; ++y)
    for (int x = 0; x < intensity.cols; ++x) {
      const auto u = random_uniform(1, Purpose::test, 0, y * intensity.cols + x);
      // Density cos(b): b = asin(u).
      const double b = std::asin(u[0]), a = 2 * kPi * u[1];
      const Vec3 normal(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
      intensity.at<float>(y, x) = static_cast<float>(kAlbedo * std::max(0.0, normal.dot(light)));
    }
  const LightEstimate found = estimate_light(intensity, {});
  // 160 000 samples: means to 0.1 %, and the ratio's slope of -0.18 a radian at 0.7 makes 0.01 of
  // it.
  EXPECT_NEAR(found.slant_rad, kSlant, 0.02);
  EXPECT_NEAR(found.albedo, kAlbedo, 0.01);
}

TEST(Shading, TiltPointsToTheLightOnASphere) {
  constexpr int kSize = 128;
  for (const double tilt : {0.3, 2.0, -2.6, -0.9}) {
    const Picture picture = render(kSize, cap(kSize, 60.0, 55.0, -1.0), light_direction(0.6, tilt));
    const LightEstimate found = estimate_light(picture.intensity, picture.valid);
    const double error = std::remainder(found.tilt_rad - tilt, 2 * kPi);
    EXPECT_LE(std::abs(error), 0.03) << "tilt " << tilt;  // pixel grid of a 55 px disk
  }
}

// Z moves both backward differences by one: the derivative is that of R(p + h, q + h).
TEST(Shading, DerivativeByDepthIsTheDifferenceQuotient) {
  constexpr double kStep = 1e-5, kTruncation = 1e-8;  // third derivatives are of order 1
  int checked = 0;
  for (int i = 0; i < 200; ++i) {
    const auto n = random_normal(11, Purpose::test, 0, i);
    const double p = 0.5 * n[0], q = 0.5 * n[1];
    const Vec3 light = light_direction(0.3 + 0.1 * n[2], n[3]);
    if (light.z() + p * light.x() + q * light.y() < 0.05) continue;  // in shadow
    const double quotient = (reflectance(p + kStep, q + kStep, light).value -
                             reflectance(p - kStep, q - kStep, light).value) /
                            (2.0 * kStep);
    EXPECT_NEAR(reflectance(p, q, light).by_depth, quotient, kTruncation);
    ++checked;
  }
  EXPECT_GE(checked, 150);
}

TEST(Shading, DarkPictureGivesTheDefaultLight) {
  const LightEstimate found = estimate_light(cv::Mat::zeros(8, 8, CV_32F), {});
  EXPECT_EQ(found.slant_rad, 0.0);
  EXPECT_EQ(found.albedo, 1.0);
}

TEST(Shading, FirstIterationIsTheNewtonStepFromAFlatStart) {
  // Flat: R = cos s, dR/dZ = sin s (cos t + sin t); W is negligible, so Z = (E - R) / (dR/dZ).
  constexpr double kSlant = 0.5, kTilt = 0.2, kShade = 0.95;
  ShadingOptions options;
  options.iterations = 1;
  const cv::Mat intensity(3, 3, CV_32F, cv::Scalar(kShade));
  const cv::Mat relief = tsai_shah(intensity, {}, {kSlant, kTilt, 1.0}, options);
  const double slope = std::sin(kSlant) * (std::cos(kTilt) + std::sin(kTilt));
  const double expected = (kShade - std::cos(kSlant)) / slope;
  constexpr double kSinglePrecision = 1e-5;
  EXPECT_NEAR(relief.at<float>(1, 1), expected, kSinglePrecision);
}

TEST(Shading, FlatWallHasNoRelief) {
  constexpr double kSlant = 0.5;
  const Picture picture = render(
      32, [](double, double) { return 7.0; }, light_direction(kSlant, 0.3));
  const cv::Mat relief =
      tsai_shah(picture.intensity, picture.valid, {kSlant, 0.3, 1.0}, ShadingOptions{});
  EXPECT_LE(cv::norm(relief, cv::NORM_INF), 1e-5);
}

// Under light from the viewer the sign of the relief is a convention (a bulge and a dent look the
// same): bright is near, as it is for an endoscope's own light.
TEST(Shading, SphereBulgesTowardsTheViewerUnderFrontalLight) {
  constexpr int kSize = 128;
  const Picture picture = render(kSize, cap(kSize, 80.0, 50.0, -1.0), light_direction(0.0, 0.0));
  const cv::Mat relief =
      tsai_shah(picture.intensity, picture.valid, {0.0, 0.0, 1.0}, ShadingOptions{});
  // The rim's pixels have no neighbour to the left or above to take a slope from.
  cv::Mat inner;
  cv::erode(picture.valid, inner, cv::Mat::ones(13, 13, CV_8U));
  EXPECT_GE(correlation(relief, picture.depth, inner), 0.95);
  EXPECT_LE(relief.at<float>(64, 64), relief.at<float>(64, 20));
}

// Under light from the side the linear approximation, which holds the neighbours' depths of the
// iteration before, answers with the slope towards the light: the relief follows p cos(tilt) + q
// sin(tilt) of the surface, not its height.
TEST(Shading, SphereUnderLightFromTheSideGivesTheSlopeTowardsTheLight) {
  constexpr int kSize = 128;
  constexpr double kSlant = 0.8, kTilt = 0.7, kRadius = 80.0;
  for (const double sign : {-1.0, 1.0}) {
    const Picture picture =
        render(kSize, cap(kSize, kRadius, 50.0, sign), light_direction(kSlant, kTilt));
    const cv::Mat relief =
        tsai_shah(picture.intensity, picture.valid, {kSlant, kTilt, 1.0}, ShadingOptions{});
    cv::Mat slope = cv::Mat::zeros(kSize, kSize, CV_32F);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)  // z = sign sqrt(R^2 - r^2), grad z = -(x, y) / z
        if (picture.valid.at<uchar>(y, x) != 0)
          slope.at<float>(y, x) =
              static_cast<float>(-((x - 64.0) * std::cos(kTilt) + (y - 64.0) * std::sin(kTilt)) /
                                 picture.depth.at<float>(y, x));
    EXPECT_GE(correlation(relief, slope, picture.valid), 0.9) << "sign " << sign;
  }
}

TEST(Shading, WaveUnderLightFromTheSideIsSteepestWhereTheReliefIsLargest) {
  constexpr int kSize = 128;
  constexpr double kAmplitude = 1.0, kPeriod = 32.0, kSlant = 0.6;
  const auto phase = [](double x) { return 2 * kPi * x / kPeriod; };
  const Picture picture = render(
      kSize, [&](double x, double) { return kAmplitude * std::sin(phase(x)); },
      light_direction(kSlant, 0.0));
  const cv::Mat relief =
      tsai_shah(picture.intensity, picture.valid, {kSlant, 0.0, 1.0}, ShadingOptions{});
  cv::Mat slope(kSize, kSize, CV_32F);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) slope.at<float>(y, x) = static_cast<float>(std::cos(phase(x)));
  EXPECT_GE(correlation(relief, slope, {}), 0.9);
}

TEST(Shading, WhatLiesOutsideTheMaskDoesNotMatter) {
  constexpr int kSize = 64;
  const Picture picture = render(kSize, cap(kSize, 40.0, 25.0, -1.0), light_direction(0.6, 0.5));
  cv::Mat spoiled = picture.intensity.clone();
  spoiled.setTo(0.77f, picture.valid == 0);
  const LightEstimate light = estimate_light(picture.intensity, picture.valid);
  EXPECT_EQ(estimate_light(spoiled, picture.valid).slant_rad, light.slant_rad);
  const cv::Mat a = tsai_shah(picture.intensity, picture.valid, light, ShadingOptions{});
  const cv::Mat b = tsai_shah(spoiled, picture.valid, light, ShadingOptions{});
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace rugae
