#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/check.h"
#include "core/random.h"
#include "scenes/scene.h"

namespace rugae {
namespace {

constexpr float kSharpMm = 0.04f;  // a pixel's width on the wall 15 mm away

Vec3f place(int i, double size_mm = 200.0) {
  const auto u = random_uniform(1, Purpose::test, 0, static_cast<std::uint64_t>(i));
  return (size_mm * Vec3(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5)).cast<float>();
}
Vec3f direction(int i) {
  const auto n = random_normal(1, Purpose::test, 1, static_cast<std::uint64_t>(i));
  return Vec3(n[0], n[1], n[2]).normalized().cast<float>();
}
float grey(const MucosaSample& s) { return s.albedo.sum() / 3.0f; }

double spread(const std::function<double(int)>& value, int count = 6000) {
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < count; ++i) {
    const double v = value(i);
    sum += v;
    squares += v * v;
  }
  return std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count)));
}

TEST(Mucosa, TheSameSeedGivesTheSameBits) {
  const Mucosa a({}, 5), b({}, 5), other({}, 6);
  int different = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto s = a.sample(place(i), direction(i), Region::body, kSharpMm);
    const auto t = b.sample(place(i), direction(i), Region::body, kSharpMm);
    EXPECT_EQ(s.albedo, t.albedo);
    EXPECT_EQ(s.roughness, t.roughness);
    EXPECT_EQ(s.coverage, t.coverage);
    EXPECT_EQ(s.coat_gradient, t.coat_gradient);
    different += s.albedo != other.sample(place(i), direction(i), Region::body, kSharpMm).albedo;
  }
  EXPECT_GE(different, 1990);
}

TEST(Mucosa, NothingLeavesItsPhysicalRange) {
  for (const double extreme : {0.0, 1.0}) {
    MucosaOptions options;
    options.vessel_contrast = options.mottle_contrast = options.wetness = options.oil = extreme;
    const Mucosa mucosa(options, 3);
    for (int i = 0; i < 8000; ++i)
      for (const Region region : {Region::body, Region::oesophagus}) {
        const float footprint = 0.02f * static_cast<float>(1 << (i % 8));
        const auto s = mucosa.sample(place(i), direction(i), region, footprint);
        for (int c = 0; c < 3; ++c) ASSERT_TRUE(s.albedo[c] > 0.0f && s.albedo[c] < 1.0f);
        ASSERT_TRUE(s.roughness > 0.0f && s.roughness <= 1.0f);
        ASSERT_TRUE(s.coverage >= 0.0f && s.coverage <= 1.0f);
        ASSERT_TRUE(s.f0 > 0.015f && s.f0 < 0.05f);                         // water to oil
        ASSERT_TRUE(std::abs(s.coat_gradient.dot(direction(i))) <= 1e-5f);  // tangential
        ASSERT_TRUE(s.coat_gradient.norm() <= 1.5f);
      }
  }
}

TEST(Mucosa, IsContinuous) {
  // Between points 2 um apart nothing may jump: an edge of a tile or of the lattice would.
  const Mucosa mucosa({}, 1);
  float largest = 0.0f;
  for (int i = 0; i < 20000; ++i) {
    const Vec3f p = place(i), n = direction(i);
    const auto s = mucosa.sample(p, n, Region::body, kSharpMm);
    const auto t = mucosa.sample(p + 0.002f * direction(i + 1), n, Region::body, kSharpMm);
    largest = std::max(largest, (s.albedo - t.albedo).cwiseAbs().maxCoeff());
    largest = std::max(largest, std::abs(s.coverage - t.coverage));
  }
  EXPECT_TRUE(largest <= 0.02f) << largest;
}

TEST(Mucosa, HasDetailDownToAFifthOfAMillimetre) {
  const Mucosa mucosa({}, 1);
  const auto difference = [&](float apart_mm) {
    return spread([&](int i) {
      const Vec3f n = direction(i), along = n.cross(direction(i + 1)).normalized();
      return grey(mucosa.sample(place(i), n, Region::body, kSharpMm)) -
             grey(mucosa.sample(place(i) + apart_mm * along, n, Region::body, kSharpMm));
    });
  };
  const double contrast = spread(
      [&](int i) { return grey(mucosa.sample(place(i), direction(i), Region::body, kSharpMm)); });
  EXPECT_GE(contrast, 0.01);
  // much of it changes within millimetres, and a noticeable part within 0.2 mm
  EXPECT_GE(difference(0.2f), 0.2 * contrast);
  EXPECT_GE(difference(2.0f), 0.6 * contrast);
}

TEST(Mucosa, DetailFinerThanAPixelFadesIntoRoughness) {
  const Mucosa mucosa({}, 1);
  double last_contrast = 1e9, last_slope = 1e9, last_roughness = 0.0, first_roughness = 0.0;
  for (const float footprint : {0.05f, 0.15f, 0.4f, 1.5f}) {
    // contrast over 0.4 mm: what fades
    const double contrast = spread([&](int i) {
      const Vec3f n = direction(i), along = n.cross(direction(i + 1)).normalized();
      return grey(mucosa.sample(place(i), n, Region::body, footprint)) -
             grey(mucosa.sample(place(i) + 0.4f * along, n, Region::body, footprint));
    });
    const double slope = spread([&](int i) {
      return mucosa.sample(place(i), direction(i), Region::body, footprint).coat_gradient.x();
    });
    const double roughness =
        mucosa.sample(place(0), direction(0), Region::body, footprint).roughness;
    if (first_roughness == 0.0) first_roughness = roughness;
    EXPECT_LT(contrast, last_contrast);
    EXPECT_LE(slope, last_slope);
    EXPECT_GE(roughness, last_roughness);
    last_contrast = contrast;
    last_slope = slope;
    last_roughness = roughness;
  }
  EXPECT_EQ(last_slope, 0.0);                        // at 1.5 mm a pixel no ripple is left,
  EXPECT_GE(last_roughness, 1.2 * first_roughness);  // and the highlight is as wide as with them
}

TEST(Mucosa, OilClosesAndSmoothsTheWetLayer) {
  MucosaOptions dry, oily;
  oily.oil = 1.0;
  const Mucosa a(dry, 1), b(oily, 1);
  double coverage[2] = {}, roughness[2] = {}, f0[2] = {}, slope[2] = {};
  for (int i = 0; i < 5000; ++i)
    for (int k = 0; k < 2; ++k) {
      const auto s = (k ? b : a).sample(place(i), direction(i), Region::body, kSharpMm);
      coverage[k] += s.coverage / 5000;
      roughness[k] += s.roughness / 5000;
      f0[k] += s.f0 / 5000;
      slope[k] += s.coat_gradient.norm() / 5000;
      if (k == 0) {
        EXPECT_EQ(s.f0, a.sample(place(0), direction(0), Region::body, kSharpMm).f0);
      }
    }
  EXPECT_GE(coverage[1], coverage[0] + 0.15);
  EXPECT_LE(roughness[1], 0.75 * roughness[0]);
  EXPECT_LE(slope[1], 0.7 * slope[0]);
  EXPECT_GT(f0[1], f0[0]);
}

TEST(Mucosa, VesselsRedden) {
  MucosaOptions bare, veined;
  bare.vessel_contrast = 0.0;
  veined.vessel_contrast = 0.5;
  const Mucosa a(bare, 1), b(veined, 1);
  int under_vessel = 0;
  for (int i = 0; i < 8000; ++i) {
    const auto s = a.sample(place(i), direction(i), Region::body, kSharpMm);
    const auto t = b.sample(place(i), direction(i), Region::body, kSharpMm);
    EXPECT_LE(t.albedo.y(), s.albedo.y());  // haemoglobin never brightens
    if (t.albedo.y() > 0.95f * s.albedo.y()) continue;
    ++under_vessel;
    // green is taken more than red
    EXPECT_LT(t.albedo.y() / s.albedo.y(), t.albedo.x() / s.albedo.x());
  }
  EXPECT_GE(under_vessel, 40);    // they are there,
  EXPECT_LE(under_vessel, 2400);  // and they do not cover the wall
}

TEST(Mucosa, NoPeriodOfATileIsSeen) {
  // The tiles repeat after 8 cells, which is 18.4 mm along the axes for the areae and 64 mm for the
  // vessels: what lies so far apart must not be alike.
  const Mucosa mucosa({}, 1);
  constexpr int kCount = 4000;
  constexpr double kStatistical = 3.0 / 63.0;  // three standard errors of a correlation of 4000
  for (const float shift_mm : {18.4f, 64.0f})
    for (int axis = 0; axis < 2; ++axis) {
      double a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
      for (int i = 0; i < kCount; ++i) {
        const Vec3f p = place(i), n = direction(i);
        const double x = grey(mucosa.sample(p, n, Region::body, kSharpMm));
        const double y =
            grey(mucosa.sample(p + shift_mm * Vec3f::Unit(axis), n, Region::body, kSharpMm));
        a += x / kCount, b += y / kCount;
        aa += x * x / kCount, bb += y * y / kCount, ab += x * y / kCount;
      }
      const double correlation = (ab - a * b) / std::sqrt((aa - a * a) * (bb - b * b));
      EXPECT_TRUE(std::abs(correlation) <= kStatistical) << shift_mm << ": " << correlation;
    }
}

TEST(MucosaOptions, NameTheBadField) {
  const auto message = [](MucosaOptions options) -> std::string {
    try {
      options.check("stomach.yaml: mucosa");
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  MucosaOptions options;
  EXPECT_EQ(message(options), "no error");
  options.wetness = 1.5;
  EXPECT_EQ(message(options), "stomach.yaml: mucosa: wetness is 1.5, expected 0 to 1");
  options = {};
  options.oil = std::nan("");
  EXPECT_EQ(message(options), "stomach.yaml: mucosa: oil is nan, expected 0 to 1");
  options = {};
  options.base_albedo.y() = 1.0;
  EXPECT_EQ(message(options),
            "stomach.yaml: mucosa: base_albedo is [0.62, 1, 0.1], expected values between 0 and "
            "1");
}

}  // namespace
}  // namespace rugae
