// Peristalsis and breathing against what is stated of them: speed, period, depth, occlusion; and a
// wall that stays a wall at every phase.

#include "scenes/deformation.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "scenes/stomach.h"
#include "self_intersection.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

constexpr double kRounding = 1e-9;  // mm; of a few double operations on lengths of 100 mm

DeformationOptions peristalsis() {
  DeformationOptions options;
  options.peristalsis = true;
  return options;
}
DeformationOptions breathing() {
  DeformationOptions options;
  options.breathing = true;
  return options;
}
DeformationOptions both() {
  DeformationOptions options = peristalsis();
  options.breathing = true;
  return options;
}

// A straight organ along x from -40 to 240 mm, its balls 2 mm apart; along it s = x + 40 mm. The
// zone is whole from x = 60 to 150 mm.
OrganAxis straight(double radius_mm) {
  std::vector<AxisNode> nodes;
  for (double x = -40.0; x <= 240.0; x += 20.0) nodes.push_back({Vec3(x, 0, 0), radius_mm});
  return OrganAxis(nodes, 2.0, 1.0, 1.0, Vec3::UnitY());
}
constexpr PeristalsisZone kZone{
    .rise_from_mm = 80.0, .rise_to_mm = 100.0, .fall_from_mm = 190.0, .fall_to_mm = 210.0};
constexpr double kZoneStartMm = 40.0;  // its x

// A row of points along the straight organ's wall, `step_mm` apart from `from_mm` on.
std::vector<Vec3> row(double radius_mm, double from_mm, double to_mm, double step_mm) {
  std::vector<Vec3> points;
  for (double x = from_mm; x <= to_mm; x += step_mm)
    points.emplace_back(x, 0.6 * radius_mm, -0.8 * radius_mm);
  return points;
}

std::vector<Vec3> moved(const OrganMotion& motion, double time_s) {
  std::vector<Vec3> points;
  motion.motion(time_s, points);
  return points;
}

const StomachWall& coarse() {
  static const StomachWall wall = make_stomach({}, 1, 2.12);
  return wall;
}
OrganMotion stomach_motion(const DeformationOptions& options) {
  const StomachShape shape({}, 1);
  return make_motion(options, shape.peristalsis_zone(), shape.axis(), coarse().mesh.vertices);
}

TEST(Deformation, IsEmptyWhereNothingMoves) {
  const OrganMotion still = stomach_motion({});
  EXPECT_FALSE(still.motion);
  EXPECT_EQ(still.reach_mm, 0.0);
}

TEST(Deformation, ZeroAmplitudesAreTheIdentity) {
  DeformationOptions options = both();
  options.amplitude_mm = options.sway_mm = 0.0;
  const OrganMotion motion = stomach_motion(options);
  EXPECT_EQ(motion.reach_mm, 0.0);
  for (const double time_s : {0.0, 1.3, 17.0})
    EXPECT_EQ(moved(motion, time_s), coarse().mesh.vertices);
}

// The deepest point of a row sampled every 0.05 mm, by the parabola through its neighbours: exact
// to far below the step.
double crest_mm(const OrganMotion& motion, double time_s, double radius_mm) {
  const std::vector<Vec3> points = moved(motion, time_s);
  const auto radius = [&](std::size_t i) { return points[i].tail<2>().norm(); };
  std::size_t best = 1;
  for (std::size_t i = 1; i + 1 < points.size(); ++i)
    if (radius(i) < radius(best)) best = i;
  EXPECT_LE(radius(best), radius_mm - 1.0);
  const double a = radius(best - 1), b = radius(best), c = radius(best + 1);
  return points[best].x() +
         0.5 * (a - c) / (a - 2.0 * b + c) * (points[best + 1].x() - points[best].x());
}

TEST(Peristalsis, TheCrestTravelsAtTheStatedSpeedAndComesAgainAfterAPeriod) {
  constexpr double kRadius = 30.0;
  const OrganMotion motion = make_motion(peristalsis(), kZone, straight(kRadius),
                                         row(kRadius, 70.0, 113.0, 0.05));  // one wave long: 44 mm
  const double start_s = (75.0 - kZoneStartMm) / 2.2;
  constexpr double kPlaceMm = 0.01;  // s is a mean over balls 2 mm apart: off by less than that
  for (double after_s = 0.0; after_s < 15.0; after_s += 2.5)
    EXPECT_NEAR(crest_mm(motion, start_s + after_s, kRadius), 75.0 + 2.2 * after_s, kPlaceMm);
  const std::vector<Vec3> now = moved(motion, start_s), later = moved(motion, start_s + 20.0);
  for (std::size_t i = 0; i < now.size(); ++i)
    EXPECT_TRUE((now[i] - later[i]).norm() <= kRounding) << i;
}

TEST(Peristalsis, WideLumenIsIndentedByTheAmplitudeAndNarrowByTheOcclusion) {
  const auto least_radius = [](double radius_mm) {
    const OrganMotion motion =
        make_motion(peristalsis(), kZone, straight(radius_mm), row(radius_mm, 75.0, 145.0, 0.25));
    double least = 1e9;
    for (double time_s = 0.0; time_s < 20.0; time_s += 0.5)
      for (const Vec3& p : moved(motion, time_s)) least = std::min(least, p.tail<2>().norm());
    return least;
  };
  constexpr double kSamplingMm = 0.01;  // rows every 0.25 mm and 1.1 mm of travel a step
  EXPECT_NEAR(least_radius(30.0), 30.0 - 7.0, kSamplingMm);
  EXPECT_NEAR(least_radius(18.0), 18.0 - 7.0, kSamplingMm);
  EXPECT_NEAR(least_radius(8.0), 8.0 * (1.0 - 0.58), kSamplingMm);
}

TEST(Peristalsis, AContractionHasTheStatedWidth) {
  EXPECT_EQ(contraction_profile(0.0, 16.0), 1.0);
  EXPECT_NEAR(contraction_profile(8.0, 16.0), 0.5, 1e-6);
  EXPECT_NEAR(contraction_profile(-8.0, 16.0), 0.5, 1e-6);
  EXPECT_EQ(contraction_profile(18.0, 16.0), 0.0);
}

// On the stomach: the depth below rest grows from the body to the antrum, where it is the stated
// amplitude, and the stated occlusion is reached before the pylorus.
TEST(Peristalsis, GrowsFromTheBodyToTheAntrumOfTheStomach) {
  const StomachShape shape({}, 1);
  const PeristalsisZone zone = shape.peristalsis_zone();
  const std::vector<Vec3>& rest = coarse().mesh.vertices;
  const OrganMotion motion = stomach_motion(peristalsis());
  std::vector<double> deepest(rest.size(), 0.0), share(rest.size(), 0.0);
  std::vector<AxisPoint> at;
  std::vector<double> off_axis_mm;
  for (const Vec3& p : rest) {
    at.push_back(shape.locate(p));
    off_axis_mm.push_back(
        (at.back().greater_mm * at.back().greater + at.back().side_mm * at.back().side).norm());
  }
  for (double time_s = 0.0; time_s < 20.0; time_s += 0.5) {
    const std::vector<Vec3> now = moved(motion, time_s);
    for (std::size_t v = 0; v < rest.size(); ++v) {
      const double depth = (now[v] - rest[v]).norm();
      deepest[v] = std::max(deepest[v], depth);
      share[v] = std::max(share[v], depth / off_axis_mm[v]);
    }
  }
  double body = 0.0, antrum = 0.0, occlusion = 0.0;
  int antral = 0;
  for (std::size_t v = 0; v < rest.size(); ++v) {
    if (at[v].s_mm < zone.rise_from_mm) {
      EXPECT_EQ(deepest[v], 0.0);  // fundus and upper body stay
    }
    if (at[v].s_mm < 0.5 * (zone.rise_from_mm + zone.rise_to_mm)) body = std::max(body, deepest[v]);
    if (at[v].s_mm > zone.rise_to_mm && off_axis_mm[v] > 14.5) {
      antrum += deepest[v];
      ++antral;
    }
    occlusion = std::max(occlusion, share[v]);
    EXPECT_TRUE(deepest[v] <= motion.reach_mm);
  }
  EXPECT_LE(body, 4.5);
  EXPECT_NEAR(antrum / antral, 7.0, 0.05);  // sampled every 1.1 mm of the crest's way
  EXPECT_NEAR(occlusion, 0.58, 0.005);
}

TEST(Breathing, IsASwayOfTheStatedHeightAndPeriod) {
  const OrganAxis axis = straight(30.0);
  const std::vector<Vec3> rest = row(30.0, -40.0, 240.0, 5.0);
  const OrganMotion motion = make_motion(breathing(), kZone, axis, rest);
  const std::vector<Vec3> in = moved(motion, 8.0), out = moved(motion, 10.0);  // 4 s a breath
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const Vec3 sway = in[i] - out[i];
    EXPECT_TRUE((sway - Vec3(sway.x(), 0, 0)).norm() <= kRounding);
    EXPECT_TRUE(sway.x() <= 4.0 + kRounding && sway.x() >= 2.0 - kRounding) << sway.x();
  }
  EXPECT_NEAR((in[0] - out[0]).x(), 4.0, 0.01);
  const std::vector<Vec3> again = moved(motion, 12.0);
  for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_TRUE((again[i] - in[i]).norm() <= kRounding);
  EXPECT_NEAR(motion.reach_mm, 2.0, kRounding);
}

// Second differences in time: bounded by the largest acceleration, whatever the step. The bump's
// second derivative is at most 6 / L^2, so a wave of 7 mm at v = 2.2 mm/s with L = 17.6 mm
// accelerates by at most 7 * 6 (v / L)^2 = 0.66 mm/s^2 on the axis' scale; the greater curvature
// lies up to 1.5 radii off. A sway of 2 mm in 4 s: 4 * 6 / (2 s)^2 = 6 mm/s^2.
TEST(Deformation, IsSmoothInTime) {
  const OrganMotion motion = stomach_motion(both());
  constexpr double kAccelerationMmS2 = 8.0;
  for (const double step_s : {0.1, 0.01, 0.001})
    for (double time_s = 0.0; time_s < 24.0; time_s += 1.7) {
      const std::vector<Vec3> a = moved(motion, time_s - step_s), b = moved(motion, time_s),
                              c = moved(motion, time_s + step_s);
      double most = 0.0;
      for (std::size_t v = 0; v < a.size(); ++v)
        most = std::max(most, (a[v] - 2.0 * b[v] + c[v]).norm() / (step_s * step_s));
      EXPECT_TRUE(most <= kAccelerationMmS2) << time_s << " s, step " << step_s << ": " << most;
    }
}

TEST(Deformation, TheWallStaysAWallAtEveryPhase) {
  const OrganMotion motion = stomach_motion(both());
  TriangleMesh wall = coarse().mesh;
  const double volume = signed_volume_mm3(wall);
  for (int phase = 0; phase < 8; ++phase) {
    motion.motion(2.5 * phase, wall.vertices);
    EXPECT_EQ(self_intersections(wall), 0) << "phase " << phase;
    const double share = signed_volume_mm3(wall) / volume;
    EXPECT_TRUE(share >= 0.9 && share <= 1.01) << share;  // two rings of a few ml
  }
}

TEST(Deformation, FoldsAtFullDetailDoNotPassThroughEachOtherEither) {
  const StomachShape shape({}, 1);
  TriangleMesh wall = make_stomach({}, 1, 0.96).mesh;
  const OrganMotion motion =
      make_motion(both(), shape.peristalsis_zone(), shape.axis(), wall.vertices);
  for (const double time_s : {3.0, 11.0}) {
    motion.motion(time_s, wall.vertices);
    EXPECT_EQ(self_intersections(wall), 0) << time_s;
  }
}

TEST(Deformation, IsTheSameOnAnyNumberOfThreadsAndAtEveryCall) {
  const OrganMotion motion = stomach_motion(both());
  const std::vector<Vec3> many = moved(motion, 7.3);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(moved(stomach_motion(both()), 7.3), many);
  moved(motion, 1.0);
  EXPECT_EQ(moved(motion, 7.3), many);
}

TEST(Deformation, OptionsOutOfRangeAreNamed) {
  DeformationOptions options;
  options.occlusion = 1.2;
  EXPECT_EQ(message_of([&] { options.check("deformation"); }),
            "deformation: occlusion is 1.2, expected 0 to 0.9");
  options = {};
  options.amplitude_mm = std::nan("");
  EXPECT_EQ(message_of([&] { options.check("deformation"); }),
            "deformation: amplitude_mm is nan, expected 0 to 20");
  options = {};
  options.width_mm = 30.0;
  EXPECT_EQ(message_of([&] { options.check("deformation"); }),
            "deformation: width_mm is 30, expected at most 20.0 where waves are 44.0 mm apart "
            "(speed_mm_s 2.2, waves_per_minute 3)");
}

}  // namespace
}  // namespace rugae
