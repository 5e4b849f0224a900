#include "trajectories/tube.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/portable_math.h"
#include "core/units.h"
#include "trajectories/spline.h"

namespace rugae {
namespace {

/// Frames that turn as little as possible along a line, by double reflection: Wang, Juettler, Zheng
/// and Liu, Computation of rotation minimizing frames, TOG 2008, table I,
/// doi:10.1145/1330511.1330513. Third column: the tangent.
std::vector<Quat> minimal_frames(const std::vector<Vec3>& points,
                                 const std::vector<Vec3>& tangents) {
  std::vector<Quat> frames;
  Vec3 across = tangents[0].unitOrthogonal();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) {
      const Vec3 v1 = points[i] - points[i - 1];
      const double c1 = v1.squaredNorm();
      if (c1 > 0.0) {
        const Vec3 across_l = across - (2.0 / c1) * v1.dot(across) * v1;
        const Vec3 tangent_l = tangents[i - 1] - (2.0 / c1) * v1.dot(tangents[i - 1]) * v1;
        const Vec3 v2 = tangents[i] - tangent_l;
        const double c2 = v2.squaredNorm();
        across = c2 > 0.0 ? Vec3(across_l - (2.0 / c2) * v2.dot(across_l) * v2) : across_l;
      }
    }
    across = (across - across.dot(tangents[i]) * tangents[i]).normalized();
    Mat3 m;
    m << across, tangents[i].cross(across), tangents[i];
    frames.emplace_back(m);
  }
  return frames;
}

/// How far from `origin` in direction `ray` the space stays at least `keep_mm` deep: steps as long
/// as the distance to the wall allows.
double free_distance(const FreeSpace& space, const Vec3& origin, const Vec3& ray, double keep_mm) {
  constexpr double kStopMm = 0.2;
  constexpr int kMaxSteps = 200;
  double t = 0.0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double room = space.depth_mm(origin + t * ray) - keep_mm;
    if (!(room > kStopMm)) break;
    t += room;
  }
  return t;
}

}  // namespace

Tube::Tube(const FreeSpace& space, const std::vector<Vec3>& axis, double keep_mm) : axis_(axis) {
  // The axis is bent at most so much that cross-sections do not meet inside the free space.
  constexpr double kMostOfBendRadius = 0.8;
  constexpr int kFrameSmoothingRounds = 100;  // standard deviation: 7 stations of 64
  const int n = static_cast<int>(axis_.size()), spans = n - 3;
  length_mm_ = arc_length(axis_).total();

  std::vector<Vec3> points, tangents;
  const double before_first = -1.0, step = 1.0;  // frames at the control points' own parameters
  for (int i = 0; i < n; ++i) {
    const double u = std::clamp(before_first + i * step, 0.0, double(spans));
    const Vec3 slope = spline_slope(axis_, u);
    points.push_back(spline_value(axis_, u));
    tangents.push_back(slope.norm() > 0.0 ? Vec3(slope.normalized()) : Vec3::UnitZ());
  }
  // The frames turn evenly, not in the sharp bends alone: [1 2 1] / 4 many times is a Gaussian.
  for (int round = 0; round < kFrameSmoothingRounds; ++round) {
    std::vector<Vec3> next(tangents);
    for (int i = 1; i + 1 < n; ++i)
      next[i] = (tangents[i - 1] + 2.0 * tangents[i] + tangents[i + 1]).normalized();
    tangents = std::move(next);
  }
  frames_ = minimal_frames(points, tangents);

  // Curvature vector: the change of the tangent a mm.
  const double step_mm = std::max(length_mm_ / spans, 1e-9);
  std::vector<double> free(static_cast<std::size_t>(n) * kAzimuths);
  tbb::parallel_for(0, n, [&](int i) {
    const int a = std::max(i - 1, 0), b = std::min(i + 1, n - 1);
    const Vec3 bend = (tangents[b] - tangents[a]) / (std::max(b - a, 1) * step_mm);
    for (int k = 0; k < kAzimuths; ++k) {
      const double angle = 2.0 * kPi * k / kAzimuths;
      const SineCosine azimuth = portable_sin_cos(angle);
      const Vec3 ray = frames_[i] * Vec3(azimuth.cosine, azimuth.sine, 0.0);
      double extent = free_distance(space, points[i], ray, keep_mm);
      const double inward = bend.dot(ray);
      if (inward > 0.0) extent = std::min(extent, kMostOfBendRadius / inward);
      free[i * kAzimuths + k] = extent;
    }
  });

  // A spline lies within the hull of the control values near it: taking the least of the
  // neighbours first keeps it below what was measured.
  extents_.resize(free.size());
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < kAzimuths; ++k) {
      double least = free[i * kAzimuths + k];
      for (int di = -1; di <= 1; ++di)
        for (int dk = -1; dk <= 1; ++dk)
          least = std::min(
              least,
              free[std::clamp(i + di, 0, n - 1) * kAzimuths + (k + dk + kAzimuths) % kAzimuths]);
      extents_[i * kAzimuths + k] = least;
    }
}

double Tube::parameter(double along_mm) const {
  const double spans = static_cast<double>(axis_.size()) - 3.0;
  return length_mm_ > 0.0 ? std::clamp(along_mm / length_mm_, 0.0, 1.0) * spans : 0.0;
}

Quat Tube::frame(double along_mm) const { return spline_rotation(frames_, parameter(along_mm)); }

double Tube::extent_mm(double along_mm, double angle_rad) const {
  const auto [i, t] = spline_span(parameter(along_mm), axis_.size());
  const auto w = bspline_weights(t);
  const double turns = angle_rad / (2.0 * kPi);
  const double v = (turns - std::floor(turns)) * kAzimuths;
  const int k = static_cast<int>(std::floor(v));
  const auto wk = bspline_weights(v - k);
  double extent = 0.0;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b)
      extent += w[a] * wk[b] * raw_extent(i + a, (k + b - 1 + 2 * kAzimuths) % kAzimuths);
  return extent;
}

Vec3 Tube::point(double along_mm, const Vec2& beside_mm) const {
  const Vec3 on_axis = spline_value(axis_, parameter(along_mm));
  const double r = beside_mm.norm();
  if (!(r > 0.0)) return on_axis;
  // r' = r / (1 + (r/R)^4)^(1/4) < R, and r' = r to fourth order near the axis.
  const double extent = extent_mm(along_mm, portable_atan2(beside_mm.y(), beside_mm.x()));
  if (!(extent > 0.0)) return on_axis;
  const double ratio = r / extent;
  const double drawn = 1.0 / std::sqrt(std::sqrt(1.0 + ratio * ratio * ratio * ratio));
  const Vec2 inside = drawn * beside_mm;
  return on_axis + frame(along_mm) * Vec3(inside.x(), inside.y(), 0.0);
}

}  // namespace rugae
