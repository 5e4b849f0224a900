#include "scenes/organ_axis.h"

#include <emmintrin.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/units.h"

namespace rugae {
namespace {

constexpr std::size_t kMaxBalls = 256;
// Balls farther than this many softness lengths beyond the nearest weigh less than 1.3e-4: left
// out, which moves the surface by less than 1.3e-4 softness lengths.
constexpr double kReach = 9.0;

// Catmull-Rom: the cubic through p1 and p2 with tangents (p2 - p0) / 2 and (p3 - p1) / 2.
template <typename T>
T catmull_rom(const T& p0, const T& p1, const T& p2, const T& p3, double t) {
  const double tt = t * t, ttt = tt * t;
  return T(0.5 * ((2.0 * p1) + (p2 - p0) * t + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * tt +
                  (3.0 * p1 - p0 - 3.0 * p2 + p3) * ttt));
}

}  // namespace

struct OrganAxis::Weights {
  std::array<double, kMaxBalls + 1> value;  // distance, then weight of those near
  std::array<double, kMaxBalls + 1> from_centre_mm;
  std::array<int, kMaxBalls> near;
  int count = 0;
  double sum = 0.0;
};

OrganAxis::OrganAxis(const std::vector<AxisNode>& nodes, double step_mm, double softness_mm,
                     double depth, const Vec3& pole)
    : softness_mm_(softness_mm), depth_(depth) {
  check(nodes.size() >= 2, "organ axis: {} nodes, expected at least 2", nodes.size());
  const int last = static_cast<int>(nodes.size()) - 1;
  const auto node = [&](int i) -> const AxisNode& { return nodes[std::clamp(i, 0, last)]; };
  double s = 0.0;
  for (int i = 0; i <= last; ++i) {
    node_s_mm_.push_back(s);
    if (i == last) {
      balls_.push_back({nodes[i].centre, Vec3::Zero(), Vec3::Zero(), nodes[i].radius_mm, s});
      break;
    }
    const double span = (nodes[i + 1].centre - nodes[i].centre).norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(span / step_mm)));
    for (int k = 0; k < steps; ++k) {
      const double t = static_cast<double>(k) / steps, next = static_cast<double>(k + 1) / steps;
      const auto at = [&](double u) {
        return catmull_rom<Vec3>(node(i - 1).centre, node(i).centre, node(i + 1).centre,
                                 node(i + 2).centre, u);
      };
      const double r = catmull_rom<double>(node(i - 1).radius_mm, node(i).radius_mm,
                                           node(i + 1).radius_mm, node(i + 2).radius_mm, t);
      balls_.push_back({at(t), Vec3::Zero(), Vec3::Zero(), r, s});
      s += (at(next) - at(t)).norm();
    }
  }
  check(balls_.size() <= kMaxBalls, "organ axis: {} balls, expected at most {}", balls_.size(),
        kMaxBalls);
  const int count = static_cast<int>(balls_.size());
  double step_sum = 0.0;
  for (int i = 0; i < count; ++i) {
    const Vec3 tangent =
        (balls_[std::min(i + 1, count - 1)].centre - balls_[std::max(i - 1, 0)].centre)
            .normalized();
    balls_[i].greater = tangent.cross(pole).normalized();
    balls_[i].side = balls_[i].greater.cross(tangent);
    if (i) step_sum += (balls_[i].centre - balls_[i - 1].centre).norm();
  }
  // Beside a straight row of balls of radius r, one every h, the sum of weights is near
  // sqrt(2 pi r k) / h: taking its logarithm off keeps the envelope at the radius asked for.
  const double h = step_sum / std::max(1, count - 1);
  for (int i = 0; i < count; i += 2) {
    Pair pair;
    for (int lane = 0; lane < 2; ++lane) {
      const bool real = i + lane < count;
      const Ball& b = balls_[std::min(i + lane, count - 1)];
      pair.x[lane] = real ? b.centre.x() : 1e9;
      pair.y[lane] = b.centre.y() / depth;
      pair.z[lane] = b.centre.z();
      pair.radius[lane] = b.radius_mm;
    }
    pairs_.push_back(pair);
  }
  double r_mean = 0.0;
  for (const Ball& b : balls_) r_mean += b.radius_mm / count;
  log_overlap_ = std::max(0.0, portable_log(std::sqrt(2.0 * kPi * r_mean * softness_mm_) / h));
}

double OrganAxis::weigh(const Vec3& p, Weights& w) const {
  const __m128d px = _mm_set1_pd(p.x()), py = _mm_set1_pd(p.y() / depth_), pz = _mm_set1_pd(p.z());
  __m128d least2 = _mm_set1_pd(1e30);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    const __m128d x = _mm_sub_pd(px, _mm_loadu_pd(pair.x)),
                  y = _mm_sub_pd(py, _mm_loadu_pd(pair.y)),
                  z = _mm_sub_pd(pz, _mm_loadu_pd(pair.z));
    const __m128d from_centre =
        _mm_sqrt_pd(_mm_add_pd(_mm_add_pd(_mm_mul_pd(x, x), _mm_mul_pd(y, y)), _mm_mul_pd(z, z)));
    const __m128d distance = _mm_sub_pd(from_centre, _mm_loadu_pd(pair.radius));
    least2 = _mm_min_pd(least2, distance);
    _mm_storeu_pd(&w.from_centre_mm[2 * k], from_centre);
    _mm_storeu_pd(&w.value[2 * k], distance);
  }
  const double least =
      std::min(_mm_cvtsd_f64(least2), _mm_cvtsd_f64(_mm_unpackhi_pd(least2, least2)));
  w.sum = 0.0;
  w.count = 0;
  for (std::size_t i = 0; i < balls_.size(); ++i) {
    const double x = (least - w.value[i]) / softness_mm_;
    if (!(x > -kReach)) continue;
    w.value[i] = portable_exp(x);
    w.sum += w.value[i];
    w.near[w.count++] = static_cast<int>(i);
  }
  // smooth minimum: -k ln sum exp(-d_i / k)
  return least - softness_mm_ * (portable_log(w.sum) - log_overlap_);
}

double OrganAxis::distance_mm(const Vec3& p, Vec3* gradient) const {
  Weights w;
  const double distance = weigh(p, w);
  if (!gradient) return distance;
  const Vec3 metric(1.0, 1.0 / (depth_ * depth_), 1.0);
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < w.count; ++n) {
    const int i = w.near[n];
    sum += (w.value[i] / std::max(w.from_centre_mm[i], 1e-9)) *
           (p - balls_[i].centre).cwiseProduct(metric);
  }
  *gradient = sum / w.sum;
  return distance;
}

AxisPoint OrganAxis::locate(const Vec3& p) const {
  Weights w;
  AxisPoint result;
  result.distance_mm = weigh(p, w);
  const Vec3 metric(1.0, 1.0 / (depth_ * depth_), 1.0);
  for (int n = 0; n < w.count; ++n) {
    const int i = w.near[n];
    const double share = w.value[i] / w.sum;
    const Vec3 from_centre = p - balls_[i].centre;
    result.gradient +=
        (share / std::max(w.from_centre_mm[i], 1e-9)) * from_centre.cwiseProduct(metric);
    result.s_mm += share * balls_[i].s_mm;
    result.greater_mm += share * from_centre.dot(balls_[i].greater);
    result.side_mm += share * from_centre.dot(balls_[i].side);
    result.greater += share * balls_[i].greater;
    result.side += share * balls_[i].side;
  }
  result.cos_greater =
      result.greater_mm / std::max(1e-9, std::sqrt(result.greater_mm * result.greater_mm +
                                                   result.side_mm * result.side_mm));
  result.along = result.side.cross(result.greater);
  return result;
}

Vec3 OrganAxis::direction_to(double share) const {
  const auto ball =
      std::ranges::find_if(balls_, [&](const Ball& b) { return b.s_mm >= share * length_mm(); });
  return (ball->centre - balls_.front().centre).normalized();
}

Eigen::AlignedBox3d OrganAxis::box() const {
  Eigen::AlignedBox3d box;
  for (const Ball& b : balls_) {
    const Vec3 r = Vec3::Constant(b.radius_mm + 2.0 * softness_mm_);
    box.extend(b.centre - r);
    box.extend(b.centre + r);
  }
  return box;
}

}  // namespace rugae
