// Sampling of the wall's reflection: densities against their samplers, and the furnace.
#include "render/scatter.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace rugae {
namespace {

std::array<double, 4> numbers(std::uint64_t draw) {
  return random_uniform(3, Purpose::test, 11, draw);
}

ShadedPoint wall_point(double roughness, double coverage, double f0, const Vec3f& gradient,
                       float albedo = 0.5f) {
  MucosaSample sample;
  sample.albedo = Vec3f::Constant(albedo);
  sample.roughness = static_cast<float>(roughness);
  sample.coverage = static_cast<float>(coverage);
  sample.f0 = static_cast<float>(f0);
  sample.coat_gradient = gradient;
  const Vec3f n = Vec3f(0.3f, -0.5f, 0.8f).normalized();
  return {n.cast<double>(), n, sample, -n.cast<double>()};
}

// A direction `angle_rad` off the point's normal.
Vec3 tilted(const ShadedPoint& p, double angle_rad, double azimuth_rad) {
  const Vec3 a = p.normal.unitOrthogonal(), b = p.normal.cross(a);
  return std::cos(angle_rad) * p.normal +
         std::sin(angle_rad) * (std::cos(azimuth_rad) * a + std::sin(azimuth_rad) * b);
}

struct Case {
  double roughness, coverage, f0;
  Vec3f gradient;
  double angle_rad;
};
const Case kCases[] = {{0.3, 0.0, 0.02, Vec3f::Zero(), 0.6},
                       {0.3, 1.0, 0.02, Vec3f::Zero(), 0.1},
                       {0.5, 0.8, 0.3, Vec3f(0.2f, 0.1f, 0.0f), 0.7},
                       {0.9, 1.0, 0.9, Vec3f(-0.1f, 0.3f, 0.2f), 1.3},
                       {0.2, 0.6, 0.05, Vec3f::Zero(), 1.1}};

// The sphere around the normal in bands of equal solid angle.
constexpr int kBands = 24, kSectors = 24, kCells = kBands * kSectors;
int cell_of(const ShadedPoint& p, const Vec3& w) {
  const Vec3 a = p.normal.unitOrthogonal(), b = p.normal.cross(a);
  const int band = std::min(kBands - 1, static_cast<int>(0.5 * (w.dot(p.normal) + 1.0) * kBands));
  const double turn = std::atan2(w.dot(b), w.dot(a)) / (2.0 * kPi) + 0.5;
  return band * kSectors + std::min(kSectors - 1, static_cast<int>(turn * kSectors));
}

// The density over a cell, by the midpoint rule.
std::vector<double> density_by_cell(const ShadedPoint& p, const Vec3& out, int fine) {
  std::vector<double> mass(kCells, 0.0);
  const Vec3 a = p.normal.unitOrthogonal(), b = p.normal.cross(a);
  const double solid_angle = 4.0 * kPi / (kCells * fine * fine);
  for (int band = 0; band < kBands * fine; ++band)
    for (int sector = 0; sector < kSectors * fine; ++sector) {
      const double cosine = 2.0 * (band + 0.5) / (kBands * fine) - 1.0;
      const double sine = std::sqrt(1.0 - cosine * cosine);
      const double azimuth = 2.0 * kPi * ((sector + 0.5) / (kSectors * fine) - 0.5);
      const Vec3 w = cosine * p.normal + sine * (std::cos(azimuth) * a + std::sin(azimuth) * b);
      mass[static_cast<std::size_t>(band / fine * kSectors + sector / fine)] +=
          scatter_pdf(p, w, out) * solid_angle;
    }
  return mass;
}

TEST(Scatter, TheDensityIntegratesToOne) {
  for (const Case& c : kCases) {
    const ShadedPoint p = wall_point(c.roughness, c.coverage, c.f0, c.gradient);
    double sum = 0.0;
    for (double mass : density_by_cell(p, tilted(p, c.angle_rad, 0.4), 40)) sum += mass;
    // The midpoint rule over 960 x 960 directions; the kink at the horizon costs the most.
    EXPECT_NEAR(sum, 1.0, 1e-3) << "roughness " << c.roughness << " angle " << c.angle_rad;
  }
}

// Counts by cell against the density: chi-square, at a chance of 1e-6 of a false alarm for
// Wilson and Hilferty's approximation (z = 4.75).
TEST(Scatter, TheSamplerFollowsItsDensity) {
  constexpr int kDraws = 200000;
  for (const Case& c : kCases) {
    const ShadedPoint p = wall_point(c.roughness, c.coverage, c.f0, c.gradient);
    const Vec3 out = tilted(p, c.angle_rad, 0.4);
    std::vector<int> counts(kCells, 0);
    int below = 0;
    for (int i = 0; i < kDraws; ++i) {
      const ScatterSample s = sample_scatter(p, out, numbers(static_cast<std::uint64_t>(i)));
      ASSERT_NEAR(s.direction.norm(), 1.0, 1e-12);
      if (s.pdf == 0.0) {
        ++below;
        continue;
      }
      ASSERT_NEAR(s.pdf, scatter_pdf(p, s.direction, out), 1e-12 * s.pdf);
      ++counts[static_cast<std::size_t>(cell_of(p, s.direction))];
    }
    const std::vector<double> mass = density_by_cell(p, out, 40);
    double chi2 = 0.0, pooled = 0.0, pooled_count = 0.0;
    int freedom = -1;
    for (int i = 0; i < kCells; ++i) {
      const double expected = mass[static_cast<std::size_t>(i)] * kDraws;
      const bool above = i / kSectors >= kBands / 2;
      if (above && expected >= 20.0) {
        chi2 += std::pow(counts[static_cast<std::size_t>(i)] - expected, 2) / expected;
        ++freedom;
      } else {  // few a cell, and what leads into the wall
        pooled += expected;
        pooled_count += counts[static_cast<std::size_t>(i)];
      }
    }
    pooled_count += below;
    if (pooled >= 20.0) {
      chi2 += std::pow(pooled_count - pooled, 2) / pooled;
      ++freedom;
    }
    const double k = 2.0 / (9.0 * freedom);
    const double z = (std::cbrt(chi2 / freedom) - (1.0 - k)) / std::sqrt(k);
    EXPECT_TRUE(z <= 4.75) << "chi-square " << chi2 << " of " << freedom << ", roughness "
                           << c.roughness << ", angle " << c.angle_rad;
  }
}

// f cos / pdf is what a path carries on: a white wall under any coat never gives more than it gets,
// and its mean is what quadrature over the hemisphere gives.
TEST(Scatter, TheFurnaceByItsSamples) {
  constexpr int kDraws = 40000;
  for (double roughness : {0.1, 0.3, 0.8})
    for (double f0 : {0.02, 0.3, 1.0})
      for (double coverage : {0.0, 0.5, 1.0})
        for (double angle : {0.1, 0.8, 1.4}) {
          const ShadedPoint p = wall_point(roughness, coverage, f0, Vec3f::Zero(), 1.0f);
          const Vec3 out = tilted(p, angle, 2.0);
          double sum = 0.0, sum2 = 0.0;
          for (int i = 0; i < kDraws; ++i) {
            const ScatterSample s = sample_scatter(p, out, numbers(static_cast<std::uint64_t>(i)));
            if (!(s.pdf > 0.0)) continue;
            const Scattered f = scatter(p, s.direction, out);
            const double weight = (f.wall + f.coat) / s.pdf;
            sum += weight;
            sum2 += weight * weight;
          }
          const double mean = sum / kDraws;
          const double error = std::sqrt(std::max(0.0, sum2 / kDraws - mean * mean) / kDraws);
          EXPECT_TRUE(mean <= 1.0 + 5.0 * error + 1e-6)
              << mean << " +- " << error << " at roughness " << roughness << ", F0 " << f0
              << ", coverage " << coverage << ", angle " << angle;
          if (coverage == 0.0) {
            EXPECT_NEAR(mean, 1.0, 1e-6);
          }
        }
}

// scatter is the model of bsdf.h where both layers have one normal.
TEST(Scatter, IsTheReflectionModel) {
  const ShadedPoint p = wall_point(0.3, 0.6, 0.1, Vec3f::Zero(), 0.4f);
  const Vec3 a = p.normal.unitOrthogonal(), b = p.normal.cross(a);
  const auto local = [&](const Vec3& w) { return Vec3(w.dot(a), w.dot(b), w.dot(p.normal)); };
  for (std::uint64_t i = 0; i < 200; ++i) {
    const auto u = numbers(i);
    const Vec3 in = tilted(p, 1.5 * u[0], 6.0 * u[1]), out = tilted(p, 1.5 * u[2], 6.0 * u[3]);
    const Scattered f = scatter(p, in, out);
    const double cos_in = in.dot(p.normal);
    EXPECT_NEAR(f.wall, wall_brdf(p.coat, 1.0, local(in), local(out)) * cos_in, 1e-12);
    EXPECT_NEAR(f.coat, coat_brdf(p.coat, local(in), local(out)) * cos_in, 1e-9 * (1.0 + f.coat));
  }
  EXPECT_EQ(scatter(p, -p.normal, p.normal).wall, 0.0);
  EXPECT_EQ(scatter(p, p.normal, -p.normal).coat, 0.0);
}

}  // namespace
}  // namespace rugae
