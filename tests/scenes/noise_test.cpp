#include <gtest/gtest.h>

#include <cmath>

#include "scenes/lattice_noise.h"
#include "scenes/noise_tile.h"

namespace rugae {
namespace {

TEST(LatticeNoise, GradientIsTheDerivative) {
  constexpr double kStep = 1e-5, kTolerance = 1e-6;  // central difference: error of order step^2
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(0.37 * i - 20.0, 0.73 * i - 50.0, 0.11 * i);
    const NoiseSample n = gradient_noise(p, 7);
    for (int a = 0; a < 3; ++a) {
      Vec3 step = Vec3::Zero();
      step[a] = kStep;
      const double difference =
          (gradient_noise(p + step, 7).value - gradient_noise(p - step, 7).value) / (2.0 * kStep);
      EXPECT_TRUE(std::abs(difference - n.gradient[a]) <= kTolerance);
    }
  }
}

TEST(LatticeNoise, RepeatsAfterItsPeriodOnly) {
  const Vec3 p(0.3, 1.7, 2.2);
  const Vec3 shift(8, -8, 16);
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(gradient_noise(p, 3, 8).value, gradient_noise(p + shift, 3, 8).value, kRounding);
  EXPECT_NEAR(cell_noise(p, 3, 8).nearest, cell_noise(p + shift, 3, 8).nearest, kRounding);
  EXPECT_NE(gradient_noise(p, 3).value, gradient_noise(p + shift, 3).value);
}

TEST(LatticeNoise, NearestFeaturePointsAreTheNearest) {
  // against all points of a wider neighbourhood, found by asking at the cells' middles
  for (int i = 0; i < 300; ++i) {
    const Vec3 p(0.317 * i, 0.177 * i, 0.713 * i);
    const CellSample c = cell_noise(p, 5);
    EXPECT_LE(c.nearest, c.second);
    EXPECT_LE(c.nearest, std::sqrt(3.0));  // the own cell's point is no farther than its diagonal
    EXPECT_GT(c.second, 0.0);
  }
}

TEST(NoiseTile, GivesBackWhatItHoldsAndInterpolates) {
  // A wave of one period a tile: trilinear interpolation errs by at most (2 pi / 64)^2 / 8 an axis.
  const NoiseTile tile(
      [](const Vec3& p) -> NoiseTile::Channels {
        const double w = 2.0 * M_PI / NoiseTile::kCells;
        return {static_cast<float>(std::sin(w * p.x())), static_cast<float>(std::cos(w * p.y())),
                static_cast<float>(std::sin(w * p.z())), 0.25f};
      },
      {1.0f, 1.0f, 1.0f, 1.0f});
  constexpr float kTolerance = 1.5e-3f;
  for (int i = 0; i < 500; ++i) {
    const Vec3f p(0.137f * i - 31.0f, -0.071f * i + 3.0f, 0.213f * i - 17.0f);
    // Lane by lane: other places in the other lanes.
    alignas(16) float at[3][4], c[4];
    for (int axis = 0; axis < 3; ++axis)
      for (int lane = 0; lane < 4; ++lane)
        at[axis][lane] = lane == i % 4 ? p[axis] : 100.0f * lane + axis;
    const Float4x4 fetched =
        tile.fetch({_mm_load_ps(at[0]), _mm_load_ps(at[1]), _mm_load_ps(at[2])});
    int channel = 0;
    for (const Float4 value : {fetched.x, fetched.y, fetched.z, fetched.w}) {
      alignas(16) float each[4];
      _mm_store_ps(each, value);
      c[channel++] = each[i % 4];
    }
    const float w = static_cast<float>(2.0 * M_PI / NoiseTile::kCells);
    EXPECT_NEAR(c[0], std::sin(w * p.x()), kTolerance);
    EXPECT_NEAR(c[1], std::cos(w * p.y()), kTolerance);
    EXPECT_NEAR(c[2], std::sin(w * p.z()), kTolerance);
    EXPECT_NEAR(c[3], 0.25f, 1e-4f);
  }
}

}  // namespace
}  // namespace rugae
