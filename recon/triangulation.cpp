#include "recon/triangulation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace rugae {
namespace {

constexpr int kMaxPairs = 30;
constexpr int kGaussNewtonSteps = 8;

double ray_error(const Sight& sight, const Vec3& point) {
  const Vec3 p_cam = sight.cam_from_world * point;
  if (!(p_cam.z() > 0.0)) return std::numeric_limits<double>::infinity();
  return (p_cam.head<2>() / p_cam.z() - sight.ray).norm();
}

// The point nearest to all lines of sight, sum |(I - d d^T)(X - c)|^2 over directions d and centres
// c: the start of the Gauss-Newton steps.
std::optional<Vec3> linear(const std::vector<Sight>& sights) {
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Sight& s : sights) {
    const Vec3 direction =
        s.cam_from_world.rotation.conjugate() * Vec3(s.ray.x(), s.ray.y(), 1.0).normalized();
    const Mat3 across = Mat3::Identity() - direction * direction.transpose();
    const Vec3 centre = -(s.cam_from_world.rotation.conjugate() * s.cam_from_world.translation);
    normal += across;
    right += across * centre;
  }
  const Eigen::LDLT<Mat3> solver(normal);
  const double smallest = solver.vectorD().minCoeff(), largest = solver.vectorD().maxCoeff();
  if (!(smallest > 1e-12 * largest)) return std::nullopt;  // parallel rays
  const Vec3 point = solver.solve(right);
  if (!point.allFinite()) return std::nullopt;
  return point;
}

}  // namespace

double parallax_rad(const std::vector<Sight>& sights, const Vec3& point) {
  std::vector<Vec3> directions;
  directions.reserve(sights.size());
  for (const Sight& s : sights) {
    const Vec3 p_cam = s.cam_from_world * point;
    directions.push_back((s.cam_from_world.rotation.conjugate() * p_cam).normalized());
  }
  double smallest_cos = 1.0;
  for (std::size_t i = 0; i < directions.size(); ++i)
    for (std::size_t j = i + 1; j < directions.size(); ++j)
      smallest_cos = std::min(smallest_cos, directions[i].dot(directions[j]));
  return std::acos(std::clamp(smallest_cos, -1.0, 1.0));
}

std::optional<Vec3> triangulate(const std::vector<Sight>& sights) {
  if (sights.size() < 2) return std::nullopt;
  const auto start = linear(sights);
  if (!start) return std::nullopt;
  Vec3 point = *start;
  for (int step = 0; step < kGaussNewtonSteps; ++step) {
    // r = (p_x, p_y) / p_z - ray with p = R X + t;  dr/dX = 1/p_z [1 0 -x; 0 1 -y] R.
    Mat3 normal = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    for (const Sight& s : sights) {
      const Vec3 p = s.cam_from_world * point;
      if (!(p.z() > 0.0)) return std::nullopt;
      const double x = p.x() / p.z(), y = p.y() / p.z();
      Eigen::Matrix<double, 2, 3> by_p;
      by_p << 1.0, 0.0, -x, 0.0, 1.0, -y;
      const Eigen::Matrix<double, 2, 3> j =
          by_p / p.z() * s.cam_from_world.rotation.toRotationMatrix();
      normal += j.transpose() * j;
      right -= j.transpose() * (Vec2(x, y) - s.ray);
    }
    const Vec3 delta = normal.ldlt().solve(right);
    if (!delta.allFinite()) return std::nullopt;
    point += delta;
    if (delta.norm() <= 1e-14 * point.norm()) break;
  }
  for (const Sight& s : sights)
    if (!((s.cam_from_world * point).z() > 0.0)) return std::nullopt;
  return point;
}

std::optional<RobustPoint> triangulate_robust(const std::vector<Sight>& sights, double threshold,
                                              double min_parallax_rad) {
  const int n = static_cast<int>(sights.size());
  if (n < 2) return std::nullopt;
  const auto judge = [&](const Vec3& point) {
    RobustPoint r{point, std::vector<char>(n, 0), 0};
    for (int i = 0; i < n; ++i) {
      r.inlier[i] = ray_error(sights[i], point) <= threshold;
      r.inliers += r.inlier[i];
    }
    return r;
  };
  const auto finished = [&](RobustPoint r) -> std::optional<RobustPoint> {
    std::vector<Sight> agreeing;
    for (int i = 0; i < n; ++i)
      if (r.inlier[i]) agreeing.push_back(sights[i]);
    const auto point = triangulate(agreeing);
    if (!point) return std::nullopt;
    r = judge(*point);
    if (r.inliers < 2) return std::nullopt;
    agreeing.clear();
    for (int i = 0; i < n; ++i)
      if (r.inlier[i]) agreeing.push_back(sights[i]);
    if (!(parallax_rad(agreeing, *point) >= min_parallax_rad)) return std::nullopt;
    return r;
  };

  if (const auto all = triangulate(sights)) {
    const RobustPoint r = judge(*all);
    if (r.inliers == n) return finished(r);
  }
  if (n == 2) return std::nullopt;
  std::optional<RobustPoint> best;
  int tried = 0;
  for (int gap = n - 1; gap >= 1 && tried < kMaxPairs; --gap) {
    for (int i = 0; i + gap < n && tried < kMaxPairs; ++i, ++tried) {
      const auto point = triangulate({sights[i], sights[i + gap]});
      if (!point) continue;
      RobustPoint r = judge(*point);
      if (!best || r.inliers > best->inliers) best = std::move(r);
    }
  }
  // Two sights always agree with each other: more than half of all must.
  if (!best || 2 * best->inliers <= n) return std::nullopt;
  return finished(*best);
}

}  // namespace rugae
