#include "core/sim3.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace rugae {
namespace {

constexpr double kRounding = 1e-11;  // coordinates near 100, a few dozen operations in double

std::vector<Vec3> scattered(int count) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    const auto n = random_normal(7, Purpose::test, 0, i);
    points.emplace_back(30.0 * n[0], 20.0 * n[1], 10.0 * n[2]);
  }
  return points;
}

Sim3 some_sim3() {
  return {2.5, Quat(Eigen::AngleAxisd(2.1, Vec3(1, -2, 0.5).normalized())), Vec3(12, -7, 40)};
}

std::vector<Vec3> moved(const Sim3& t, const std::vector<Vec3>& points) {
  std::vector<Vec3> result;
  for (const Vec3& p : points) result.push_back(t * p);
  return result;
}

TEST(Sim3, InverseUndoesAndProductsCompose) {
  const Sim3 a = some_sim3(), b{0.3, Quat(Eigen::AngleAxisd(-0.4, Vec3::UnitY())), Vec3(1, 2, 3)};
  const Vec3 p(4, 5, -6);
  EXPECT_TRUE((a.inverse() * (a * p) - p).norm() <= kRounding);
  EXPECT_TRUE(((a * b) * p - a * (b * p)).norm() <= kRounding);
}

TEST(Umeyama, RecoversAnExactSimilarity) {
  const Sim3 truth = some_sim3();
  const auto source = scattered(20);
  const auto found = umeyama(source, moved(truth, source), true);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, truth.scale, kRounding);
  EXPECT_TRUE(found->rotation.angularDistance(truth.rotation) <=
              1e-7);  // acos near 1 halves the digits
  EXPECT_TRUE((found->translation - truth.translation).norm() <= 1e-10);
}

TEST(Umeyama, RigidKeepsScaleAtOne) {
  const auto source = scattered(20);
  const auto found = umeyama(source, moved(some_sim3(), source), false);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->scale, 1.0);
}

TEST(Umeyama, NeverReflects) {
  const auto source = scattered(20);
  auto target = source;
  for (Vec3& p : target) p.x() = -p.x();
  const auto found = umeyama(source, target, true);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->rotation.toRotationMatrix().determinant(), 1.0, kRounding);

  // A turn cannot undo a reflection, but it is the best turn there is: any small change of it, with
  // the translation that suits it best, leaves more.
  const auto residual = [&](const Quat& rotation) {
    Vec3 mean_source = Vec3::Zero(), mean_target = Vec3::Zero();
    for (std::size_t i = 0; i < source.size(); ++i) {
      mean_source += source[i] / static_cast<double>(source.size());
      mean_target += target[i] / static_cast<double>(source.size());
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < source.size(); ++i)
      sum += (found->scale * (rotation * (source[i] - mean_source)) - (target[i] - mean_target))
                 .squaredNorm();
    return sum;
  };
  const double best = residual(found->rotation);
  for (int i = 0; i < 100; ++i) {
    const auto n = random_normal(8, Purpose::test, 0, i);
    const Quat change(Eigen::AngleAxisd(0.02 * n[3], Vec3(n[0], n[1], n[2]).normalized()));
    EXPECT_TRUE(residual(change * found->rotation) >= best);
  }
}

TEST(Umeyama, RefusesWhatDoesNotDetermineARotation) {
  const auto points = scattered(20);
  EXPECT_FALSE(umeyama({points[0], points[1]}, {points[0], points[1]}, true));
  EXPECT_FALSE(umeyama(std::vector<Vec3>(5, points[0]), std::vector<Vec3>(5, points[1]), true));
  std::vector<Vec3> line;
  for (int i = 0; i < 10; ++i) line.emplace_back(1.0 * i, 2.0 * i, -3.0 * i);
  EXPECT_FALSE(umeyama(line, line, true));
  auto with_nan = points;
  with_nan[3].y() = std::nan("");
  EXPECT_FALSE(umeyama(with_nan, points, true));
}

}  // namespace
}  // namespace rugae
