#include "render/bsdf.h"

#include <gtest/gtest.h>

#include <vector>

namespace rugae {
namespace {

Vec3 direction(double cosine, double azimuth_rad) {
  const double sine = std::sqrt(1.0 - cosine * cosine);
  return {sine * std::cos(azimuth_rad), sine * std::sin(azimuth_rad), cosine};
}

constexpr double kRoughness[] = {0.05, 0.1, 0.2, 0.35, 0.5, 0.8, 1.0};
constexpr double kF0[] = {0.0, 0.02, 0.04, 0.2, 0.6, 1.0};
constexpr double kCoverage[] = {0.0, 0.3, 1.0};

// Light sent back of what comes from `out`, by the midpoint rule over half vectors for the coat,
// whose peak is narrow, and over directions for the wall:
// dw_in = 4 (out . h) dw_h.
double reflectance(const Coat& coat, double albedo, const Vec3& out) {
  constexpr int kTheta = 160, kPhi = 48;
  double sum = 0.0;
  for (int i = 0; i < kTheta; ++i) {
    // tan^2 theta = alpha^2 u / (1 - u) spreads the samples as D does.
    const double u = (i + 0.5) / kTheta, a2 = coat.roughness * coat.roughness;
    const double cosine = std::sqrt((1.0 - u) / (1.0 + (a2 - 1.0) * u));
    // d(cos) = -dcos/du du; D cos dw = 1/(2 pi) du dphi.
    const double solid_angle = 2.0 * kPi / (kTheta * kPhi) /
                               (2.0 * kPi * ggx_distribution(cosine, coat.roughness) * cosine);
    for (int k = 0; k < kPhi; ++k) {
      const Vec3 half = direction(cosine, 2.0 * kPi * (k + 0.5) / kPhi);
      const double out_half = out.dot(half);
      if (!(out_half > 0.0)) continue;
      const Vec3 in = 2.0 * out_half * half - out;
      sum += coat_brdf(coat, in, out) * std::max(0.0, in.z()) * 4.0 * out_half * solid_angle;
    }
  }
  // The wall's part has no azimuth.
  for (int i = 0; i < kTheta; ++i) {
    const double cosine = (i + 0.5) / kTheta;
    sum += wall_brdf(coat, albedo, direction(cosine, 0.0), out) * cosine * 2.0 * kPi / kTheta;
  }
  return sum;
}

TEST(Bsdf, DistributionIntegratesToOne) {
  for (double alpha : kRoughness) {
    // Midpoint rule in theta; the integrand is smooth at the scale of alpha.
    constexpr int kSteps = 20000;
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      const double theta = 0.5 * kPi * (i + 0.5) / kSteps;
      sum += ggx_distribution(std::cos(theta), alpha) * std::cos(theta) * std::sin(theta) * 2.0 *
             kPi * 0.5 * kPi / kSteps;
    }
    EXPECT_NEAR(sum, 1.0, 1e-6) << "alpha " << alpha;
  }
}

// Smith's masking is what makes the visible facets' area equal the macro surface's: with one side
// masked, the integral of G1 D (out . h) over facets that face out is cos_out (Heitz 2014, eq. 15).
TEST(Bsdf, VisibleFacetsHaveTheProjectedArea) {
  for (double alpha : {0.1, 0.3, 0.7})
    for (double cosine : {0.1, 0.4, 0.9}) {
      const Vec3 out = direction(cosine, 0.0);
      constexpr int kTheta = 1200, kPhi = 240;
      double sum = 0.0;
      for (int i = 0; i < kTheta; ++i)
        for (int k = 0; k < kPhi; ++k) {
          const double theta = 0.5 * kPi * (i + 0.5) / kTheta;
          const Vec3 half = direction(std::cos(theta), 2.0 * kPi * (k + 0.5) / kPhi);
          sum += ggx_distribution(half.z(), alpha) * std::max(0.0, out.dot(half)) *
                 std::sin(theta) * 0.5 * kPi / kTheta * 2.0 * kPi / kPhi;
        }
      // The other side of the masking is not there at normal incidence.
      EXPECT_NEAR(smith_masking(cosine, 1.0, alpha) * sum, cosine, 2e-4);
    }
}

TEST(Bsdf, NeverMoreThanCameIn) {
  for (double roughness : kRoughness)
    for (double f0 : kF0)
      for (double coverage : kCoverage)
        for (double cosine : {0.02, 0.1, 0.3, 0.6, 0.9, 1.0}) {
          const double sent_back =
              reflectance({roughness, coverage, f0}, 1.0, direction(cosine, 0.0));
          EXPECT_TRUE(sent_back <= 1.0 + 1e-9)
              << sent_back << " at roughness " << roughness << ", F0 " << f0 << ", coverage "
              << coverage << ", cosine " << cosine;
          EXPECT_TRUE(sent_back > 0.0);
        }
}

// A white furnace: without a coat the wall returns its albedo, everywhere.
TEST(Bsdf, BareWallReturnsItsAlbedo) {
  for (double albedo : {0.0, 0.35, 1.0})
    for (double cosine : {0.05, 0.5, 1.0})
      EXPECT_NEAR(reflectance({0.2, 0.0, 0.5}, albedo, direction(cosine, 0.0)), albedo, 1e-12);
}

TEST(Bsdf, WorksBothWays) {
  const Coat coat{0.25, 0.7, 0.04};
  const Vec3 a = direction(0.8, 0.3), b = direction(0.35, 2.0);
  EXPECT_DOUBLE_EQ(coat_brdf(coat, a, b), coat_brdf(coat, b, a));
  EXPECT_DOUBLE_EQ(wall_brdf(coat, 0.5, a, b), wall_brdf(coat, 0.5, b, a));
  EXPECT_EQ(coat_brdf(coat, a, -b), 0.0);
  EXPECT_EQ(wall_brdf(coat, 0.5, -a, b), 0.0);
}

// For a smooth coat, the brightest direction is the mirrored one.
TEST(Bsdf, PeaksInTheMirrorDirection) {
  const Coat coat{0.05, 1.0, 0.04};
  const Vec3 in = direction(0.8, 0.0), mirrored(-in.x(), -in.y(), in.z());
  double best = 0.0;
  Vec3 brightest = Vec3::Zero();
  for (int i = 1; i < 600; ++i)
    for (int k = 0; k < 720; ++k) {
      const Vec3 out = direction(i / 600.0, 2.0 * kPi * k / 720);
      const double f = coat_brdf(coat, in, out);
      if (f > best) {
        best = f;
        brightest = out;
      }
    }
  EXPECT_TRUE(brightest.dot(mirrored) > std::cos(rad_from_deg(0.5)));
}

TEST(Bsdf, LightAtTheEyeIsTheSameModel) {
  for (float roughness : {0.05f, 0.2f, 0.7f})
    for (float coverage : {0.0f, 0.4f, 1.0f})
      for (float f0 : {0.02f, 0.3f})
        for (float cosine : {0.05f, 0.3f, 0.7f, 0.99f, 1.0f}) {
          const Coat coat{roughness, coverage, f0};
          const Vec3 w = direction(cosine, 1.0);
          const double coat_expected = coat_brdf(coat, w, w) * w.z();
          const double wall_expected = wall_brdf(coat, 1.0, w, w) * w.z();
          // Single precision; near a narrow peak the cosine's rounding is magnified by 1/alpha^2.
          constexpr double kSinglePrecision = 2e-6;
          EXPECT_NEAR(coat_retro(cosine, roughness, coverage, f0), coat_expected,
                      kSinglePrecision / (roughness * roughness) * coat_expected + 1e-12);
          EXPECT_NEAR(wall_retro(cosine, coverage, f0), wall_expected,
                      kSinglePrecision * wall_expected);
        }
  EXPECT_EQ(coat_retro(-0.1f, 0.2f, 1.0f, 0.02f), 0.0f);
  EXPECT_EQ(wall_retro(0.0f, 1.0f, 0.02f), 0.0f);
}

}  // namespace
}  // namespace rugae
