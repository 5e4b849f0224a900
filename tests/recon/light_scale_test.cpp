// Millimetres from light beside the camera: brightness computed from the model, no pictures.

#include "recon/dense/light_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace rugae {
namespace {

struct World {
  double mm_per_unit = 20.0;
  double noise_ln = 0.0;          // of the level, each sight on its own
  double normal_error_rad = 0.0;  // of what is thought of a track's normal
  Vec3 lamp_mm{3.0, 0.0, 0.0};
  Vec2 uneven = Vec2::Zero();  // d ln light / d tangent across the picture
  std::uint64_t seed = 1;
};

constexpr int kCameras = 60, kPoints = 1500;
constexpr double kSettled = 1e-5;  // of a length: where the rounds end

Rigid3 cam_from_world_mm(int camera) {
  const double a = 0.05 * camera;
  const Vec3 centre(12.0 * std::cos(a), 12.0 * std::sin(a), 5.0 * std::sin(2.0 * a));
  const Vec3 z = Vec3(std::cos(a + 0.4), std::sin(a + 0.4), 0.3 * std::sin(a)).normalized();
  const Vec3 x = z.cross(Vec3::UnitZ()).normalized();
  Mat3 world_from_cam;
  world_from_cam << x, z.cross(x), z;
  return Rigid3(world_from_cam, centre).inverse();
}

// A cavity 40 mm around with bumps, seen up to 45 degrees off the axis.
std::vector<LightSight> sights_of(const World& world) {
  std::vector<LightSight> sights;
  const auto unit = [](const std::array<double, 4>& g) {
    return Vec3(g[0], g[1], g[2]).normalized();
  };
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 outward = unit(random_normal(world.seed, Purpose::test, 0, i));
    const Vec3 bump = unit(random_normal(world.seed, Purpose::test, 1, i));
    const Vec3 normal = -(outward + 0.3 * bump).normalized();
    const auto draw = random_normal(world.seed, Purpose::test, 2, i);
    const double ln_albedo = 0.3 * draw[0];
    const Vec3 x = normal.unitOrthogonal(), y = normal.cross(x);
    const Vec3 thought =
        (normal + world.normal_error_rad * (draw[1] * x + draw[2] * y)).normalized();
    const Vec3 tangent = thought.unitOrthogonal();
    for (int k = 0; k < kCameras; ++k) {
      const Rigid3 pose = cam_from_world_mm(k);
      const Vec3 p_mm = pose * (40.0 * outward);
      const Vec2 off_axis = p_mm.head<2>() / p_mm.z();
      const Vec3 normal_cam = pose.rotation * normal;
      if (!(p_mm.z() > 0.0 && off_axis.norm() < 1.0) || -normal_cam.dot(p_mm.normalized()) < 0.4)
        continue;
      const Vec3 from_lamp = p_mm - world.lamp_mm;
      const double light = -normal_cam.dot(from_lamp.normalized()) / from_lamp.squaredNorm();
      if (!(light > 0.0)) continue;
      const auto draws = random_normal(world.seed, Purpose::test, 10 + k, i);
      const double gain = 0.2 * std::sin(0.7 * k);
      const double r2 = off_axis.squaredNorm();
      const double fall_off = 4.0 * std::log(p_mm.normalized().z()) - 0.2 * r2 - 0.05 * r2 * r2 +
                              world.uneven.dot(off_axis);
      sights.push_back({i, k,
                        ln_albedo + gain + fall_off + std::log(light) + world.noise_ln * draws[0],
                        p_mm / world.mm_per_unit, pose.rotation * thought, pose.rotation * tangent,
                        pose.rotation * thought.cross(tangent), world.normal_error_rad, off_axis});
    }
  }
  return sights;
}

std::vector<Emitter> lamp_of(const World& world) { return {{world.lamp_mm}}; }

TEST(ReceivedLight, ItsSlopeOverTheNormal) {
  const std::vector<Emitter> lights = {
      {Vec3(3.0, -1.0, 0.0), Vec3(0.2, 0.0, 1.0).normalized(), 1.5, 1.0},
      {Vec3(-2.0, 0.5, 1.0), Vec3::UnitZ(), 0.0, 0.6}};
  LightSight sight = sights_of({})[7];
  const auto at = received_light(sight, lights, 0.05);
  ASSERT_TRUE(at.has_value());
  constexpr double kStep = 1e-5, kRounding = 1e-8;
  for (int axis = 0; axis < 3; ++axis) {
    LightSight ahead = sight, behind = sight;
    ahead.normal_cam[axis] += kStep;
    behind.normal_cam[axis] -= kStep;
    const double slope =
        (received_light(ahead, lights, 0.05)->ln - received_light(behind, lights, 0.05)->ln) /
        (2.0 * kStep);
    EXPECT_NEAR(at->per_normal[axis], slope, kRounding);
  }
  sight.normal_cam *= -1.0;
  EXPECT_FALSE(received_light(sight, lights, 0.05).has_value());
}

// A lobe, two lamps, one of them weaker: e^(-mu (1 - D.w)) cos / d^2 by hand.
TEST(ReceivedLight, ByHand) {
  LightSight sight;
  sight.p_cam = {0.0, 0.0, 10.0};
  sight.normal_cam = {0.0, 0.0, -1.0};
  const std::vector<Emitter> lights = {{Vec3(0.0, 0.0, 4.0), Vec3::UnitX(), 2.0, 3.0},
                                       {Vec3(0.0, 0.0, -10.0), Vec3::UnitZ(), 5.0, 1.0}};
  EXPECT_NEAR(received_light(sight, lights, 0.5)->ln,
              std::log(3.0 * std::exp(-2.0) / 64.0 + 1.0 / 225.0), 1e-12);
}

// What is left is what the robust weights and the tilts leave of where the rounds end.
TEST(LightScale, ExactLightGivesExactMillimetres) {
  for (const double mm_per_unit : {20.0, 0.02}) {
    World world;
    world.mm_per_unit = mm_per_unit;
    const auto scale = scale_from_light(sights_of(world), lamp_of(world));
    ASSERT_TRUE(scale.has_value());
    EXPECT_NEAR(scale->mm_per_unit / mm_per_unit, 1.0, kSettled);
    EXPECT_LE(scale->sigma_share, 1e-4);
  }
}

// Light within 0.3 % and normals 4 degrees off, as on rendered frames: what it says of its own
// error is so, over 40 worlds.
TEST(LightScale, KnowsHowFarItIsOff) {
  constexpr int kWorlds = 40;
  int within_two = 0;
  double square = 0.0;
  for (int seed = 1; seed <= kWorlds; ++seed) {
    World world;
    world.seed = static_cast<std::uint64_t>(seed);
    world.noise_ln = 0.003;
    world.normal_error_rad = 0.07;
    const auto scale = scale_from_light(sights_of(world), lamp_of(world));
    ASSERT_TRUE(scale.has_value());
    const double error = (scale->mm_per_unit / world.mm_per_unit - 1.0) / scale->sigma_share;
    EXPECT_LE(scale->sigma_share, 0.04);
    EXPECT_NEAR(scale->spread_ln, world.noise_ln, 0.001);
    within_two += std::abs(error) <= 2.0;
    square += error * error / kWorlds;
  }
  std::printf("error over sigma: %.2f, within two: %d of %d\n", std::sqrt(square), within_two,
              kWorlds);
  EXPECT_GE(within_two, 36);
  EXPECT_GE(std::sqrt(square), 0.5);  // nor does it say much less than it knows
  EXPECT_LE(std::sqrt(square), 1.5);
}

// Where the wall lies nearly along the light, ln cos is so steep that few such places, seen not
// quite as they are, would drive the rounds apart.
TEST(LightScale, GrazingLightMovesLittle) {
  World world;
  world.noise_ln = 0.003;
  std::vector<LightSight> sights = sights_of(world);
  const auto clean = scale_from_light(sights, lamp_of(world));
  for (LightSight& sight : sights) {
    if (sight.track % 20 != 0) continue;
    const double cosine = 0.02 + 0.002 * (sight.keyframe % 10);
    sight.p_cam = Vec3(-1.0, 0.0, 6.0) / world.mm_per_unit;
    const Vec3 from_lamp = (sight.p_cam - world.lamp_mm / world.mm_per_unit).normalized();
    const Vec3 across = Vec3::UnitY().cross(from_lamp).normalized();
    sight.normal_cam = -cosine * from_lamp + std::sqrt(1.0 - cosine * cosine) * across;
    sight.tangent_x_cam = Vec3::UnitY();
    sight.tangent_y_cam = sight.normal_cam.cross(sight.tangent_x_cam);
    sight.ln_level = -7.0 + 0.1 * (sight.keyframe % 7);
  }
  const auto spoilt = scale_from_light(sights, lamp_of(world));
  ASSERT_TRUE(clean.has_value() && spoilt.has_value());
  EXPECT_LE(std::abs(spoilt->mm_per_unit / clean->mm_per_unit - 1.0), spoilt->sigma_share);
  EXPECT_LE(spoilt->sigma_share, 2.0 * clean->sigma_share);
}

// A fisheye sees what lies behind its own plane, where the natural fall-off leaves no light.
TEST(LightScale, WhatLiesBehindTheLensPlaneSaysNothing) {
  std::vector<LightSight> sights = sights_of(World{});
  for (std::size_t i = 0; i < sights.size(); i += 50) {
    sights[i].p_cam.z() *= -0.1;
    sights[i].normal_cam = -sights[i].p_cam.normalized();
  }
  const auto scale = scale_from_light(sights, lamp_of(World{}));
  ASSERT_TRUE(scale.has_value());
  EXPECT_NEAR(scale->mm_per_unit / World{}.mm_per_unit, 1.0, kSettled);
}

// As a lens that sits a little aside makes it. It is taken for a lamp farther aside, which the
// stated uncertainty says.
TEST(LightScale, APictureBrighterOnOneSideIsUncertain) {
  World world;
  world.noise_ln = 0.003;
  const auto even = scale_from_light(sights_of(world), lamp_of(world));
  world.uneven = {0.0, -0.05};
  const auto scale = scale_from_light(sights_of(world), lamp_of(world));
  ASSERT_TRUE(even.has_value() && scale.has_value());
  const double error = std::abs(scale->mm_per_unit / world.mm_per_unit - 1.0);
  EXPECT_GE(error, 2.0 * even->sigma_share);
  EXPECT_LE(error, 2.5 * scale->sigma_share);  // twice the half, and what it is off by anyway
}

// By less than what it is uncertain by anyway.
TEST(LightScale, OneBadSightInTwentyMovesLittle) {
  World world;
  world.noise_ln = 0.003;
  std::vector<LightSight> sights = sights_of(world);
  const auto clean = scale_from_light(sights, lamp_of(world));
  for (std::size_t i = 0; i < sights.size(); i += 20) sights[i].ln_level += 0.7;  // a highlight
  const auto spoilt = scale_from_light(sights, lamp_of(world));
  ASSERT_TRUE(clean.has_value() && spoilt.has_value());
  EXPECT_LE(std::abs(spoilt->mm_per_unit / clean->mm_per_unit - 1.0), spoilt->sigma_share);
  EXPECT_LE(spoilt->sigma_share, 2.0 * clean->sigma_share);
}

TEST(LightScale, NothingIsSaidWhereNothingIsSeen) {
  World central;
  central.lamp_mm = Vec3::Zero();
  central.noise_ln = 0.01;
  EXPECT_FALSE(scale_from_light(sights_of(central), lamp_of(central)).has_value());
  // Said to be beside, but light comes from the centre: the world would be endless.
  EXPECT_FALSE(scale_from_light(sights_of(central), lamp_of(World{})).has_value());
  EXPECT_FALSE(scale_from_light({}, lamp_of(World{})).has_value());
  EXPECT_FALSE(scale_from_light(sights_of(World{}), {}).has_value());
  std::vector<LightSight> broken = sights_of(World{});
  broken[11].ln_level = NAN;
  EXPECT_FALSE(scale_from_light(broken, lamp_of(World{})).has_value());
}

}  // namespace
}  // namespace rugae
