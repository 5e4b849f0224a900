#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <unsupported/Eigen/Polynomials>
#include <vector>

#include "cameras/camera.h"
#include "core/check.h"
#include "core/units.h"

namespace rugae {
namespace {

constexpr double kNewtonTolerance = 1e-12;  // in normalised coordinates or radians
constexpr int kNewtonSteps = 50;

// Smallest positive root of 1 + c1 s + c2 s^2 + ..., the derivative of the radial mapping over s =
// r^2; infinity if there is none.
double first_turning_point(std::initializer_list<double> coefficients) {
  std::vector<double> c = {1.0};
  c.insert(c.end(), coefficients);
  while (c.size() > 1 && c.back() == 0.0) c.pop_back();
  double smallest = std::numeric_limits<double>::infinity();
  if (c.size() == 1) return smallest;
  if (c.size() == 2) return c[1] < 0.0 ? -1.0 / c[1] : smallest;
  const Eigen::VectorXd polynomial =
      Eigen::Map<const Eigen::VectorXd>(c.data(), static_cast<Eigen::Index>(c.size()));
  std::vector<double> roots;
  Eigen::PolynomialSolver<double, Eigen::Dynamic>(polynomial).realRoots(roots, 1e-9);
  for (double root : roots)
    if (root > 0.0) smallest = std::min(smallest, root);
  return smallest;
}

// Brown-Conrady: d = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + tangential(x), with
// tangential = (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y).
struct Distorted {
  Vec2 point;
  Mat2 jacobian;
};

Vec2 distorted(const Lens& lens, const Vec2& n) {
  const double x = n.x(), y = n.y(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  return {x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x),
          y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y};
}

Distorted brown_conrady(const Lens& lens, const Vec2& n) {
  const double x = n.x(), y = n.y(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double radial_by_r2 = lens.k1 + r2 * (2.0 * lens.k2 + r2 * 3.0 * lens.k3);
  Distorted d;
  d.point = distorted(lens, n);
  const double cross = 2.0 * x * y * radial_by_r2 + 2.0 * lens.p1 * x + 2.0 * lens.p2 * y;
  d.jacobian << radial + 2.0 * x * x * radial_by_r2 + 2.0 * lens.p1 * y + 6.0 * lens.p2 * x, cross,
      cross, radial + 2.0 * y * y * radial_by_r2 + 6.0 * lens.p1 * y + 2.0 * lens.p2 * x;
  return d;
}

double kannala_brandt(const Lens& lens, double theta) {
  const double t2 = theta * theta;
  return theta * (1.0 + t2 * (lens.k1 + t2 * (lens.k2 + t2 * (lens.k3 + t2 * lens.k4))));
}

double kannala_brandt_slope(const Lens& lens, double theta) {
  const double t2 = theta * theta;
  return 1.0 +
         t2 * (3.0 * lens.k1 + t2 * (5.0 * lens.k2 + t2 * (7.0 * lens.k3 + t2 * 9.0 * lens.k4)));
}

// Newton's method from a start inside the monotonic region; the step is halved while it leaves the
// region or makes the residual grow, so that the wanted root is the one found.
std::optional<Vec2> undistort(const Lens& lens, double max_angle_rad, const Vec2& target) {
  const double limit = std::tan(max_angle_rad);
  Vec2 n = target;
  // The radial part alone gives a start inside the region for any strength of barrel or pincushion.
  const double r_target = target.norm();
  if (r_target > 0.0) {
    double low = 0.0, high = std::min(limit, 1e3);
    for (int k = 0; k < 30; ++k) {
      const double r = 0.5 * (low + high), r2 = r * r;
      const double mapped = r * (1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3)));
      (mapped < r_target ? low : high) = r;
    }
    n = target / r_target * low;
  }
  Distorted d = brown_conrady(lens, n);
  double error = (d.point - target).norm();
  for (int step = 0; step < kNewtonSteps && error > 0.0; ++step) {
    const Vec2 delta = d.jacobian.inverse() * (target - d.point);
    if (!delta.allFinite()) return std::nullopt;
    double scale = 1.0;
    bool improved = false;
    for (int half = 0; half < 12 && !improved; ++half, scale *= 0.5) {
      const Vec2 candidate = n + scale * delta;
      const Distorted at = brown_conrady(lens, candidate);
      const double at_error = (at.point - target).norm();
      if (at_error < error && candidate.norm() <= limit * (1.0 + 1e-9)) {
        n = candidate;
        d = at;
        error = at_error;
        improved = true;
      }
    }
    if (!improved) break;  // rounding is reached
  }
  if (!(error <= kNewtonTolerance) || !(n.norm() <= limit * (1.0 + 1e-9))) return std::nullopt;
  return n;
}

}  // namespace

double Lens::max_angle_rad() const {
  if (model == LensModel::kannala_brandt)
    return std::min(kPi, std::sqrt(first_turning_point({3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4})));
  constexpr double kNearlyRight = 1e-3;  // rad short of 90 degrees, where r is a thousand
  const double r_limit = std::sqrt(first_turning_point({3.0 * k1, 5.0 * k2, 7.0 * k3}));
  return std::min(kPi / 2.0 - kNearlyRight, std::atan(r_limit));
}

std::optional<Vec2> Lens::project(const Vec3& p_cam) const {
  return LensProjector(*this).project(p_cam);
}

std::optional<Vec3> Lens::unproject(const Vec2& pixel) const {
  return LensProjector(*this).unproject(pixel);
}

LensProjector::LensProjector(const Lens& lens)
    : lens_(lens), max_angle_rad_(lens.max_angle_rad()), cos_limit_(std::cos(max_angle_rad_)) {}

std::optional<Vec2> LensProjector::project(const Vec3& p) const {
  const double norm = p.norm();
  if (!(norm > 0.0) || !(norm < std::numeric_limits<double>::infinity())) return std::nullopt;
  if (!(p.z() >= cos_limit_ * norm)) return std::nullopt;
  Vec2 d;
  if (lens_.model == LensModel::brown_conrady) {
    d = distorted(lens_, {p.x() / p.z(), p.y() / p.z()});
  } else {
    const double r = std::hypot(p.x(), p.y());
    if (r == 0.0) return Vec2(lens_.cx, lens_.cy);
    d = kannala_brandt(lens_, std::atan2(r, p.z())) / r * Vec2(p.x(), p.y());
  }
  return Vec2(lens_.fx * d.x() + lens_.cx, lens_.fy * d.y() + lens_.cy);
}

std::optional<Vec3> LensProjector::unproject(const Vec2& pixel) const {
  const Vec2 d((pixel.x() - lens_.cx) / lens_.fx, (pixel.y() - lens_.cy) / lens_.fy);
  if (!d.allFinite()) return std::nullopt;
  if (lens_.model == LensModel::brown_conrady) {
    const auto n = undistort(lens_, max_angle_rad_, d);
    if (!n) return std::nullopt;
    return Vec3(n->x(), n->y(), 1.0).normalized();
  }
  const double theta_d = d.norm();
  if (theta_d == 0.0) return Vec3::UnitZ();
  const double limit = max_angle_rad_;
  if (!(theta_d <= kannala_brandt(lens_, limit))) return std::nullopt;
  double low = 0.0, high = limit, theta = std::min(theta_d, limit);
  for (int step = 0; step < kNewtonSteps; ++step) {
    const double residual = kannala_brandt(lens_, theta) - theta_d;
    (residual > 0.0 ? high : low) = theta;
    double next = theta - residual / kannala_brandt_slope(lens_, theta);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double change = std::abs(next - theta);
    theta = next;
    if (change <= 1e-16 * limit) break;
  }
  if (!(std::abs(kannala_brandt(lens_, theta) - theta_d) <= kNewtonTolerance)) return std::nullopt;
  const double s = std::sin(theta) / theta_d;
  return Vec3(s * d.x(), s * d.y(), std::cos(theta));
}

Mat3 Lens::matrix() const {
  Mat3 k;
  k << fx, 0, cx, 0, fy, cy, 0, 0, 1;
  return k;
}

Lens Lens::pinhole() const {
  Lens lens;
  lens.width = width;
  lens.height = height;
  lens.fx = fx;
  lens.fy = fy;
  lens.cx = cx;
  lens.cy = cy;
  return lens;
}

void Lens::check(const std::string& where) const {
  rugae::check(width > 0 && height > 0, "{}: image size is {} x {}, expected above 0", where, width,
               height);
  rugae::check(fx > 0.0 && fy > 0.0 && std::isfinite(fx) && std::isfinite(fy),
               "{}: focal lengths are {} and {} px, expected above 0", where, fx, fy);
  for (double value : {cx, cy, k1, k2, k3, k4, p1, p2})
    rugae::check(std::isfinite(value), "{}: a lens parameter is {}, expected a finite number",
                 where, value);
  const double w = width, h = height;
  for (const Vec2& corner : {Vec2(0, 0), Vec2(w, 0), Vec2(0, h), Vec2(w, h)})
    rugae::check(unproject(corner).has_value(),
                 "{}: the distortion has no inverse at the image corner ({}, {})", where,
                 corner.x(), corner.y());
}

double vignette_at(const Vignetting& vignetting, const Lens& lens, const Vec2& pixel) {
  const auto ray = lens.unproject(pixel);
  return ray ? vignette_at(vignetting, lens, pixel, *ray) : 0.0;
}

double vignette_at(const Vignetting& vignetting, const Lens& lens, const Vec2& pixel,
                   const Vec3& ray) {
  const double half_diagonal = 0.5 * std::hypot(lens.width, lens.height);
  const double r2 =
      (pixel - Vec2(lens.cx, lens.cy)).squaredNorm() / (half_diagonal * half_diagonal);
  const double polynomial = 1.0 + r2 * (vignetting.v1 + r2 * (vignetting.v2 + r2 * vignetting.v3));
  const double cos2 = ray.z() * ray.z();
  return (vignetting.cos4 ? cos2 * cos2 : 1.0) * polynomial;
}

}  // namespace rugae
