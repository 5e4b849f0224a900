#include "trajectories/spline.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/check.h"
#include "core/random.h"
#include "core/units.h"
#include "trajectories/time_law.h"

namespace rugae {
namespace {

constexpr double kRound = 1e-12;

Vec3 random_vec(std::uint64_t index) {
  const auto n = random_normal(11, Purpose::test, 0, index);
  return {n[0], n[1], n[2]};
}

Quat turn(const Vec3& axis, double angle_rad) {
  return Quat(Eigen::AngleAxisd(angle_rad, axis.normalized()));
}

TEST(Spline, ReproducesALineAndItsSlope) {
  const Vec3 start(1.0, -2.0, 3.0), step(0.5, 0.25, -1.0);
  std::vector<Vec3> control;
  for (int i = 0; i < 9; ++i) control.push_back(start + (i - 1) * step);
  for (double u = 0.0; u <= 6.0; u += 0.13) {
    EXPECT_LE((spline_value(control, u) - (start + u * step)).norm(), kRound);
    EXPECT_LE((spline_slope(control, u) - step).norm(), kRound);
  }
}

TEST(Spline, TurnsEvenlyAboutOneAxis) {
  const Vec3 axis = Vec3(1.0, 2.0, -1.0).normalized();
  const Quat start = turn({0.0, 1.0, 1.0}, 1.1);
  std::vector<Quat> control;
  for (int i = 0; i < 9; ++i) control.push_back(start * turn(axis, 0.3 * (i - 1)));
  control[4].coeffs() = -control[4].coeffs();  // the same rotation
  for (double u = 0.0; u <= 6.0; u += 0.13) {
    EXPECT_LE(angle_between_rad(spline_rotation(control, u), start * turn(axis, 0.3 * u)), 1e-7);
    EXPECT_LE((spline_turn_rate(control, u) - 0.3 * axis).norm(), kRound);
  }
}

TEST(Spline, TurnRateIsTheDerivative) {
  std::vector<Quat> control;
  for (int i = 0; i < 12; ++i) control.push_back(turn(random_vec(i), 0.8));
  constexpr double kStep = 1e-5, kTolerance = 1e-8;  // central differences: error of kStep squared
  for (double u = 0.01; u < 8.9; u += 0.11) {
    const Quat step =
        spline_rotation(control, u - kStep).conjugate() * spline_rotation(control, u + kStep);
    const Vec3 rate = (step.w() < 0.0 ? -1.0 : 1.0) * step.vec() / kStep;
    EXPECT_LE((rate - spline_turn_rate(control, u)).norm(), kTolerance);
  }
}

TEST(Spline, GoesThroughGivenPoints) {
  std::vector<Vec3> points;
  std::vector<Quat> rotations{Quat::Identity()};
  for (int i = 0; i < 20; ++i) points.push_back(10.0 * random_vec(i));
  for (int i = 1; i < 20; ++i)
    rotations.push_back(rotations.back() * turn(random_vec(100 + i), 0.5));
  const auto control = interpolating_controls(points);
  const auto turns = interpolating_controls(rotations);
  ASSERT_EQ(control.size(), 22u);
  ASSERT_EQ(turns.size(), 22u);
  for (int i = 0; i < 20; ++i) {
    EXPECT_LE((spline_value(control, i) - points[i]).norm(), 1e-11);
    EXPECT_LE((spline_rotation(turns, i).conjugate() * rotations[i]).vec().norm(), 1e-11);
  }
}

// One that would be missed by degrees is no spline through the rotations.
TEST(Spline, RotationsThatTurnTooFarAreRefused) {
  const auto yaws = [](std::vector<double> degrees) {
    std::vector<Quat> rotations;
    for (const double yaw : degrees) rotations.push_back(turn(Vec3::UnitY(), yaw * kPi / 180.0));
    return rotations;
  };
  const std::vector<Quat> near = yaws({0, 0, 45, 0, 0});
  const std::vector<Quat> control = interpolating_controls(near);
  for (int k = 0; k < 5; ++k)
    EXPECT_LE(angle_between_rad(spline_rotation(control, k), near[k]), 1e-7);
  EXPECT_THROW(interpolating_controls(yaws({0, 0, 90, 0, 0})), Error);
}

TEST(Spline, ArcLengthOfACircle) {
  // A spline through many points of a circle differs from it by the fourth power of the step.
  std::vector<Vec3> points;
  constexpr int kPoints = 200;
  for (int i = 0; i <= kPoints; ++i) {
    const double a = 2.0 * kPi * i / kPoints;
    points.emplace_back(5.0 * std::cos(a), 5.0 * std::sin(a), 0.0);
  }
  const auto control = interpolating_controls(points);
  EXPECT_NEAR(arc_length(control).total(), 10.0 * kPi, 1e-4);
}

RC_GTEST_PROP(Spline, TravelAndItsInverseAgree, (std::uint32_t seed)) {
  const Travel travel(7, [seed](double u) {
    return 1.1 + std::sin(u * (1.0 + seed % 5)) + 0.3 * std::cos(2.0 * u);
  });
  const double way = random_uniform(seed, Purpose::test, 1, 0)[0] * travel.total();
  RC_ASSERT(std::abs(travel.at(travel.parameter(way)) - way) <= 1e-10 * travel.total());
}

TEST(TimeLaw, SteadyIsTheIdentity) {
  const TimeLaw law({}, 1);
  for (double f = 0.0; f <= 1.0; f += 0.1) EXPECT_NEAR(law.share(f), f, kRound);
}

TEST(TimeLaw, BurstsOfNoLengthAreNone) {
  const TimeLaw law({.peak_speed = 4.0, .bursts = 12, .burst_share = 0.0}, 1);
  for (double f = 0.0; f <= 1.0; f += 0.1) EXPECT_NEAR(law.share(f), f, kRound);
}

TEST(TimeLaw, BurstsReachTheirPeakAndCoverTheWholeWay) {
  const PaceOptions pace{.peak_speed = 4.0, .bursts = 12, .burst_share = 0.15};
  const TimeLaw law(pace, 5);
  EXPECT_NEAR(law.share(0.0), 0.0, kRound);
  EXPECT_NEAR(law.share(1.0), 1.0, 1e-9);
  constexpr int kSteps = 100000;
  double fastest = 0.0, slowest = 1e9;
  int fast = 0;  // steps in the upper half of the lobes
  const double base = (1.0 - 4.0 * 0.15) / 0.85;
  for (int i = 0; i < kSteps; ++i) {
    const double speed = kSteps * (law.share((i + 1.0) / kSteps) - law.share(i / double(kSteps)));
    fastest = std::max(fastest, speed);
    slowest = std::min(slowest, speed);
    fast += speed > 0.5 * (base + 4.0);
  }
  EXPECT_NEAR(fastest, 4.0, 1e-3);
  EXPECT_NEAR(slowest, base, 1e-3);
  EXPECT_NEAR(fast / double(kSteps), 0.15, 1e-3);
}

}  // namespace
}  // namespace rugae
