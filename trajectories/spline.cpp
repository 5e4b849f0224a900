#include "trajectories/spline.h"

#include "core/check.h"
#include "core/portable_math.h"

namespace rugae {
namespace {

// Abscissae and weights of the five-point Gauss-Legendre rule on [0, 1] (Abramowitz and Stegun,
// table 25.4).
constexpr std::array<double, 5> kGaussNodes = {0.04691007703066800, 0.23076534494715845, 0.5,
                                               0.76923465505284155, 0.95308992296933200};
constexpr std::array<double, 5> kGaussWeights = {0.11846344252809454, 0.23931433524968324,
                                                 0.28444444444444444, 0.23931433524968324,
                                                 0.11846344252809454};

Quat same_side(const Quat& reference, Quat q) {
  if (reference.dot(q) < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

/// exp(weight log q) for a unit quaternion, the shorter way round.
Quat power(const Quat& q_any, double weight) {
  const Quat q = same_side(Quat::Identity(), q_any);
  const double sine = q.vec().norm();
  if (sine < 1e-12) return {1.0, weight * q.x(), weight * q.y(), weight * q.z()};
  const SineCosine half = portable_sin_cos(weight * portable_atan2(sine, q.w()));
  const Vec3 v = q.vec() * (half.sine / sine);
  return {half.cosine, v.x(), v.y(), v.z()};
}

}  // namespace

Quat spline_rotation(const std::vector<Quat>& control, double u) {
  const auto [i, t] = spline_span(u, control.size());
  const auto w = bspline_weights(t);
  const double c1 = 1.0 - w[0], c2 = w[2] + w[3], c3 = w[3];
  return (control[i] * power(control[i].conjugate() * control[i + 1], c1) *
          power(control[i + 1].conjugate() * control[i + 2], c2) *
          power(control[i + 2].conjugate() * control[i + 3], c3))
      .normalized();
}

std::vector<Vec3> interpolating_controls(const std::vector<Vec3>& points) {
  // (c[k-1] + 4 c[k] + c[k+1]) / 6 = p[k] and c[-1] - 2 c[0] + c[1] = 0, so that c[0] = p[0] and
  // likewise at the end; the rest by the Thomas algorithm.
  const int n = static_cast<int>(points.size());
  check(n >= 2, "a spline needs at least two points, found {}", n);
  std::vector<Vec3> inner(points);
  std::vector<double> factor(n, 0.0);
  for (int k = 1; k + 1 < n; ++k) {
    const double pivot = 4.0 - factor[k - 1];
    factor[k] = 1.0 / pivot;
    inner[k] = (6.0 * points[k] - inner[k - 1]) / pivot;
  }
  for (int k = n - 2; k >= 1; --k) inner[k] -= factor[k] * inner[k + 1];
  std::vector<Vec3> control;
  control.reserve(n + 2);
  control.push_back(2.0 * inner[0] - inner[1]);
  control.insert(control.end(), inner.begin(), inner.end());
  control.push_back(2.0 * inner[n - 1] - inner[n - 2]);
  return control;
}

std::vector<Quat> interpolating_controls(const std::vector<Quat>& rotations) {
  constexpr int kMaxRounds = 200;
  constexpr double kToleranceRad = 1e-12;
  const int n = static_cast<int>(rotations.size());
  check(n >= 2, "a spline needs at least two rotations, found {}", n);
  std::vector<Quat> control(n + 2);
  const auto set_ends = [&] {
    control[0] = control[1] * (control[2].conjugate() * control[1]);
    control[n + 1] = control[n] * (control[n - 1].conjugate() * control[n]);
  };
  for (int k = 0; k < n; ++k) control[k + 1] = rotations[k];
  set_ends();
  // Each round moves every control by what the spline misses at its knot; the spline's weight there
  // is 2/3, so the error shrinks by about a third or better.
  double worst = 0.0;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<Quat> miss(n);
    worst = 0.0;
    for (int k = 0; k < n; ++k) {
      const Quat now = spline_rotation(control, k);
      miss[k] = now.conjugate() * rotations[k];
      worst = std::max(worst, 2.0 * miss[k].vec().norm());  // the angle, where it is small
    }
    if (worst <= kToleranceRad) break;
    for (int k = 0; k < n; ++k) control[k + 1] = (control[k + 1] * miss[k]).normalized();
    set_ends();
  }
  constexpr double kFollowedRad = 1e-6;
  check(worst <= kFollowedRad,
        "rotations turn too far between neighbours for a smooth path through them ({:.3g} rad are "
        "missed); give poses in between",
        worst);
  return control;
}

Vec3 spline_turn_rate(const std::vector<Quat>& control, double u) {
  // With A_j = exp(B_j d_j): the rate is A_3^-1 (A_2^-1 B_1' d_1 + B_2' d_2) + B_3' d_3, d_j being
  // the rotation vectors between neighbours.
  const auto [i, t] = spline_span(u, control.size());
  const auto w = bspline_weights(t);
  const auto slope = bspline_slopes(t);
  const std::array<double, 3> cumulative = {1.0 - w[0], w[2] + w[3], w[3]};
  const std::array<double, 3> rates = {-slope[0], slope[2] + slope[3], slope[3]};
  Vec3 rate = Vec3::Zero();
  for (int j = 0; j < 3; ++j) {
    const Quat step = same_side(Quat::Identity(), control[i + j].conjugate() * control[i + j + 1]);
    const double sine = step.vec().norm();
    const double angle_over_sine = sine < 1e-12 ? 2.0 : 2.0 * portable_atan2(sine, step.w()) / sine;
    rate = power(step, cumulative[j]).conjugate() * rate + rates[j] * angle_over_sine * step.vec();
  }
  return rate;
}

Travel::Travel(int spans, Speed speed) : speed_(std::move(speed)), upto_{0.0} {
  for (int k = 0; k < spans; ++k) upto_.push_back(upto_.back() + within(k, 1.0));
}

double Travel::within(int span, double t) const {
  double sum = 0.0;
  for (std::size_t g = 0; g < kGaussNodes.size(); ++g)
    sum += kGaussWeights[g] * speed_(span + t * kGaussNodes[g]);
  return t * sum;
}

double Travel::at(double u) const {
  const auto [span, t] = spline_span(u, upto_.size() + 2);
  return upto_[span] + within(span, t);
}

double Travel::parameter(double travelled) const {
  constexpr int kMaxRounds = 60;
  constexpr double kTolerance = 1e-12;  // of the total
  const auto it = std::upper_bound(upto_.begin(), upto_.end(), travelled);
  const int last = static_cast<int>(upto_.size()) - 2;
  const int span = std::clamp(static_cast<int>(it - upto_.begin()) - 1, 0, last);
  const double wanted = travelled - upto_[span];
  double low = 0.0, high = 1.0, t = 0.5;
  for (int round = 0; round < kMaxRounds; ++round) {
    const double miss = within(span, t) - wanted;
    if (std::abs(miss) <= kTolerance * total()) break;
    (miss > 0.0 ? high : low) = t;
    const double newton = t - miss / speed_(span + t);
    t = newton > low && newton < high ? newton : 0.5 * (low + high);
  }
  return span + t;
}

Travel arc_length(const std::vector<Vec3>& control) {
  return {static_cast<int>(control.size()) - 3,
          [control](double u) { return spline_slope(control, u).norm(); }};
}

}  // namespace rugae
