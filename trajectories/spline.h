#pragma once
// Uniform cubic B-splines of positions, rotations and numbers: twice continuously differentiable,
// and never outside the hull of their control points.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "core/types.h"

namespace rugae {

/// Where a parameter falls: the first of four control points, and the position t in [0, 1] between
/// the second and the third.
struct SplineSpan {
  int first = 0;
  double t = 0.0;
};
/// For a spline of `controls` >= 4 control points, whose parameter runs over [0, controls - 3];
/// beyond it the end holds.
inline SplineSpan spline_span(double u, std::size_t controls) {
  const int last = static_cast<int>(controls) - 4;
  const int first = std::clamp(static_cast<int>(std::floor(u)), 0, last);
  return {first, std::clamp(u - first, 0.0, 1.0)};
}

// Basis functions: (1-t)^3/6, (3t^3-6t^2+4)/6, (-3t^3+3t^2+3t+1)/6, t^3/6.
inline std::array<double, 4> bspline_weights(double t) {
  const double s = 1.0 - t;
  return {s * s * s / 6.0, (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
          (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0, t * t * t / 6.0};
}
inline std::array<double, 4> bspline_slopes(double t) {
  const double s = 1.0 - t;
  return {-0.5 * s * s, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t};
}

/// Value (double or Vec3) at u in [0, control.size() - 3].
template <typename T>
T spline_value(const std::vector<T>& control, double u) {
  const auto [i, t] = spline_span(u, control.size());
  const auto w = bspline_weights(t);
  return w[0] * control[i] + w[1] * control[i + 1] + w[2] * control[i + 2] + w[3] * control[i + 3];
}
/// Derivative by u.
template <typename T>
T spline_slope(const std::vector<T>& control, double u) {
  const auto [i, t] = spline_span(u, control.size());
  const auto w = bspline_slopes(t);
  return w[0] * control[i] + w[1] * control[i + 1] + w[2] * control[i + 2] + w[3] * control[i + 3];
}

/// Cumulative cubic B-spline of rotations (Kim, Kim and Shin, SIGGRAPH 1995,
/// doi:10.1145/218380.218486): q(u) = q_i prod_j exp(B_j(t) log(q_{i+j-1}^-1 q_{i+j})). Neighbours
/// must be less than half a turn apart.
Quat spline_rotation(const std::vector<Quat>& control, double u);

/// Control points of the spline through `points` (at least two) at u = 0, 1, ..., with zero second
/// derivative at both ends: points.size() + 2 of them.
std::vector<Vec3> interpolating_controls(const std::vector<Vec3>& points);
/// The same for rotations, to 1e-12 rad; neighbours less than half a turn apart.
std::vector<Quat> interpolating_controls(const std::vector<Quat>& rotations);

/// Speed of rotation of the spline, rad a unit of u, as a vector in the rotated axes.
Vec3 spline_turn_rate(const std::vector<Quat>& control, double u);

/// The integral of a positive speed over the spans [0, 1], [1, 2], ... of a spline, by
/// Gauss-Legendre quadrature, and its inverse.
class Travel {
 public:
  using Speed = std::function<double(double u)>;
  Travel(int spans, Speed speed);
  double total() const { return upto_.back(); }
  /// Travelled from u = 0 to `u`.
  double at(double u) const;
  /// Where `travelled` is reached, by Newton's method guarded by bisection.
  double parameter(double travelled) const;

 private:
  double within(int span, double t) const;

  Speed speed_;
  std::vector<double> upto_;  // at u = 0, 1, ...
};

/// Travel by arc length along the curve of the control points.
Travel arc_length(const std::vector<Vec3>& control);

}  // namespace rugae
