#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "cameras/camera.h"
#include "core/check.h"
#include "core/portable_math.h"
#include "core/units.h"

namespace rugae {
namespace {

constexpr double kNewtonTolerance = 1e-12;  // in normalised coordinates or radians
constexpr int kNewtonSteps = 50;

double polynomial_at(const std::vector<double>& coefficients, double s) {
  double sum = 0.0;
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) sum = sum * s + *c;
  return sum;
}

// Where c0 + c1 s + c2 s^2 + ... changes its sign between 0 and `most`. It is monotonic between the
// roots of its derivative, so bisection finds each.
std::vector<double> sign_changes(const std::vector<double>& c, double most) {
  std::vector<double> roots;
  if (c.size() < 2) return roots;
  std::vector<double> derivative;
  for (std::size_t k = 1; k < c.size(); ++k) derivative.push_back(static_cast<double>(k) * c[k]);
  std::vector<double> stops = sign_changes(derivative, most);
  stops.push_back(most);
  double from = 0.0;
  for (const double to : stops) {
    const bool starts_below = polynomial_at(c, from) < 0.0;
    if (starts_below != (polynomial_at(c, to) < 0.0)) {
      double low = from, high = to, middle = 0.5 * (low + high);
      for (; middle > low && middle < high; middle = 0.5 * (low + high))
        ((polynomial_at(c, middle) < 0.0) == starts_below ? low : high) = middle;
      roots.push_back(high);
    }
    from = to;
  }
  return roots;
}

// The largest argument of the radial mapping to which it is monotonic, at most `most`; the
// coefficients are those of its derivative over s, the argument's square.
double monotonic_to(const std::vector<double>& derivative, double most) {
  const std::vector<double> turns = sign_changes(derivative, most * most);
  return turns.empty() ? most : std::sqrt(turns.front());
}

// The radial mapping's argument is the tangent of the angle, or with a fisheye the angle, rad.
double largest_argument(const Lens& lens) {
  constexpr double kLargestTangent = 999.9996666666933;  // 1e-3 rad short of 90 degrees
  if (lens.model == LensModel::kannala_brandt)
    return monotonic_to({1.0, 3.0 * lens.k1, 5.0 * lens.k2, 7.0 * lens.k3, 9.0 * lens.k4}, kPi);
  return monotonic_to({1.0, 3.0 * lens.k1, 5.0 * lens.k2, 7.0 * lens.k3}, kLargestTangent);
}

double cosine_at(const Lens& lens, double argument) {
  if (lens.model == LensModel::kannala_brandt) return portable_sin_cos(argument).cosine;
  return 1.0 / std::sqrt(1.0 + argument * argument);
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
std::optional<Vec2> undistort(const Lens& lens, double limit, const Vec2& target) {
  const bool distorts =
      lens.k1 != 0.0 || lens.k2 != 0.0 || lens.k3 != 0.0 || lens.p1 != 0.0 || lens.p2 != 0.0;
  if (!distorts) return target.norm() <= limit ? std::optional(target) : std::nullopt;
  Vec2 n = target;
  // The radial part alone gives a start inside the region for any strength of barrel or pincushion.
  const double r_target = target.norm();
  if (r_target > 0.0) {
    double low = 0.0, high = limit;
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
  const double limit = largest_argument(*this);
  return model == LensModel::kannala_brandt ? limit : portable_atan2(limit, 1.0);
}

std::optional<Vec2> Lens::project(const Vec3& p_cam) const {
  return LensProjector(*this).project(p_cam);
}

std::optional<Vec3> Lens::unproject(const Vec2& pixel) const {
  return LensProjector(*this).unproject(pixel);
}

LensProjector::LensProjector(const Lens& lens)
    : lens_(lens), limit_(largest_argument(lens)), cos_limit_(cosine_at(lens, limit_)) {}

std::optional<Vec2> LensProjector::project(const Vec3& p) const {
  const double norm = p.norm();
  if (!(norm > 0.0) || !(norm < std::numeric_limits<double>::infinity())) return std::nullopt;
  if (!(p.z() >= cos_limit_ * norm)) return std::nullopt;
  Vec2 d;
  if (lens_.model == LensModel::brown_conrady) {
    d = distorted(lens_, {p.x() / p.z(), p.y() / p.z()});
  } else {
    const double r = p.head<2>().norm();
    if (r == 0.0) return Vec2(lens_.cx, lens_.cy);
    d = kannala_brandt(lens_, portable_atan2(r, p.z())) / r * Vec2(p.x(), p.y());
  }
  return Vec2(lens_.fx * d.x() + lens_.cx, lens_.fy * d.y() + lens_.cy);
}

std::optional<Vec3> LensProjector::unproject(const Vec2& pixel) const {
  const Vec2 d((pixel.x() - lens_.cx) / lens_.fx, (pixel.y() - lens_.cy) / lens_.fy);
  if (!d.allFinite()) return std::nullopt;
  if (lens_.model == LensModel::brown_conrady) {
    const auto n = undistort(lens_, limit_, d);
    if (!n) return std::nullopt;
    return Vec3(n->x(), n->y(), 1.0).normalized();
  }
  const double theta_d = d.norm();
  if (theta_d == 0.0) return Vec3::UnitZ();
  if (!(theta_d <= kannala_brandt(lens_, limit_))) return std::nullopt;
  double low = 0.0, high = limit_, theta = std::min(theta_d, limit_);
  for (int step = 0; step < kNewtonSteps; ++step) {
    const double residual = kannala_brandt(lens_, theta) - theta_d;
    (residual > 0.0 ? high : low) = theta;
    double next = theta - residual / kannala_brandt_slope(lens_, theta);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double change = std::abs(next - theta);
    theta = next;
    if (change <= 1e-16 * limit_) break;
  }
  if (!(std::abs(kannala_brandt(lens_, theta) - theta_d) <= kNewtonTolerance)) return std::nullopt;
  const SineCosine of_theta = portable_sin_cos(theta);
  const double s = of_theta.sine / theta_d;
  return Vec3(s * d.x(), s * d.y(), of_theta.cosine);
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
  const double half_diagonal = 0.5 * Vec2(lens.width, lens.height).norm();
  const double r2 =
      (pixel - Vec2(lens.cx, lens.cy)).squaredNorm() / (half_diagonal * half_diagonal);
  const double polynomial = 1.0 + r2 * (vignetting.v1 + r2 * (vignetting.v2 + r2 * vignetting.v3));
  const double cos = std::max(ray.z(), 0.0), cos2 = cos * cos;  // behind it no light comes in
  return (vignetting.cos4 ? cos2 * cos2 : 1.0) * polynomial;
}

}  // namespace rugae
