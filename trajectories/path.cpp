#include "trajectories/path.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"

namespace rugae {
namespace {

constexpr double kCheckStepMm = 0.25;
constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr int kPositionBits = 30;  // behind the point: 1e-9 mm
constexpr int kRotationBits = 40;  // 1e-12

/// Slopes of the monotone cubic through (x_k, k): Fritsch and Carlson, SIAM J. Numer. Anal. 1980,
/// doi:10.1137/0717021, with the harmonic means of Fritsch and Butland 1984, doi:10.1137/0905021.
std::vector<double> monotone_slopes(const std::vector<double>& x) {
  const std::size_t n = x.size();
  std::vector<double> slope(n);
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double h0 = x[k] - x[k - 1], h1 = x[k + 1] - x[k];
    // 3 (h0 + h1) / ((2 h1 + h0) / d0 + (h1 + 2 h0) / d1) with d = 1 / h.
    slope[k] = 3.0 * (h0 + h1) / ((2.0 * h1 + h0) * h0 + (h1 + 2.0 * h0) * h1);
  }
  slope.front() = 1.0 / (x[1] - x[0]);
  slope.back() = 1.0 / (x[n - 1] - x[n - 2]);
  return slope;
}

}  // namespace

Rigid3 PlannedPath::world_from_camera(double fraction) const {
  const double u = impl_->parameter_at(std::clamp(fraction, 0.0, 1.0));
  return {spline_rotation(impl_->rotations, u), spline_value(impl_->positions, u)};
}

double PlannedPath::length_mm() const { return impl_->length_mm; }
double PlannedPath::min_clearance_mm() const { return impl_->min_clearance_mm; }

Rigid3 sampled_pose(const PlannedPath& path, double fraction) {
  // Planning is the same to the last bit everywhere (core/portable_math.h); what lies below the
  // rounding is the error of its iterations.
  const auto rounded = [](double value, int bits) {
    return std::ldexp(std::nearbyint(std::ldexp(value, bits)), -bits);
  };
  Rigid3 pose = path.world_from_camera(fraction);
  for (double& value : pose.translation) value = rounded(value, kPositionBits);
  for (double& value : pose.rotation.coeffs()) value = rounded(value, kRotationBits);
  return pose;
}

PoseTrack sample_path(const PlannedPath& path, int frames, double fps) {
  check(frames >= 2, "a path is sampled at {} frames, expected at least 2", frames);
  check(fps > 0.0 && std::isfinite(fps),
        "a path is sampled at {} frames a second, expected more "
        "than 0",
        fps);
  PoseTrack track(frames);
  for (int i = 0; i < frames; ++i) track[i] = {i / fps, sampled_pose(path, i / (frames - 1.0))};
  return track;
}

std::string place_text(const Vec3& p) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z());
}

Clearance least_clearance(const FreeSpace& space, const std::vector<Vec3>& positions,
                          const Travel& arc) {
  const int steps = static_cast<int>(std::ceil(arc.total() / kCheckStepMm));
  const double step_mm = arc.total() / std::max(steps, 1);
  const auto point = [&](int i) { return spline_value(positions, arc.parameter(step_mm * i)); };
  // Distance changes by at most the way gone: after a sample that is deeper than the least by
  // k steps, the next k cannot undercut it. Stretches of fixed length, so that threads do not
  // matter.
  constexpr int kStretch = 128;
  std::vector<Clearance> stretches(steps / kStretch + 1, Clearance{kNone, 0.0, Vec3::Zero()});
  tbb::parallel_for(std::size_t{0}, stretches.size(), [&](std::size_t s) {
    Clearance& least = stretches[s];
    const int begin = static_cast<int>(s) * kStretch, end = std::min(begin + kStretch, steps + 1);
    for (int i = begin; i < end;) {
      const Vec3 p = point(i);
      const double depth = space.depth_mm(p);
      if (!(depth >= least.least_mm)) least = {depth, step_mm * i, p};
      const double skipped = step_mm > 0.0 ? (depth - least.least_mm) / step_mm : 0.0;
      i += 1 + static_cast<int>(std::clamp(skipped, 0.0, double(kStretch)));
    }
  });
  return *std::ranges::min_element(stretches, {}, &Clearance::least_mm);
}

void require_clearance(const Clearance& found, double clearance_mm, const std::string& name) {
  check(found.least_mm >= clearance_mm,
        "trajectory '{}' would leave the stomach: {:.1f} mm along its way, near {}, its distance "
        "to the wall is {:.2f} mm{}, expected at least {} mm",
        name, found.along_mm, place_text(found.place), found.least_mm,
        found.least_mm < 0.0 ? " (outside)" : "", clearance_mm);
}

PlannedPath::Impl follow_track(const PoseTrack& track, const std::string& name) {
  check(track.size() >= 2, "{}: {} poses, expected at least 2", name, track.size());
  std::vector<Vec3> points;
  std::vector<Quat> rotations;
  std::vector<double> times;
  for (const TimedPose& pose : track) {
    points.push_back(pose.world_from_camera.translation);
    rotations.push_back(pose.world_from_camera.rotation.normalized());
    times.push_back(pose.time_s);
  }
  PlannedPath::Impl impl;
  impl.positions = interpolating_controls(points);
  impl.rotations = interpolating_controls(rotations);
  impl.length_mm = arc_length(impl.positions).total();
  impl.parameter_at = [times, slopes = monotone_slopes(times)](double fraction) {
    const double time = times.front() + fraction * (times.back() - times.front());
    const auto next = std::upper_bound(times.begin() + 1, times.end() - 1, time);
    const auto k = static_cast<std::size_t>(next - times.begin()) - 1;
    const double h = times[k + 1] - times[k], t = std::clamp((time - times[k]) / h, 0.0, 1.0);
    // Cubic Hermite from k to k + 1.
    const double t2 = t * t, t3 = t2 * t;
    return double(k) + h * slopes[k] * (t3 - 2.0 * t2 + t) + (3.0 * t2 - 2.0 * t3) +
           h * slopes[k + 1] * (t3 - t2);
  };
  return impl;
}

void check_inside(const TriangleMesh& wall, const PoseTrack& track, double clearance_mm,
                  const std::string& name) {
  const ClosestPoint closest(wall);
  const auto require = [&](const Vec3& p, std::size_t pose, const char* where) {
    check(p.allFinite(), "{}: pose {} is not finite", name, pose);
    const double depth = -closest.signed_distance_mm(p);
    check(depth >= clearance_mm,
          "{}: {} pose {}, at {}, the camera {} {:.2f} mm from the wall, expected at least {} mm "
          "inside",
          name, where, pose, place_text(p), depth < 0.0 ? "is outside," : "is only",
          std::abs(depth), clearance_mm);
  };
  for (std::size_t i = 0; i < track.size(); ++i) {
    const Vec3& here = track[i].world_from_camera.translation;
    require(here, i, "at");
    if (i + 1 == track.size()) break;
    const Vec3& there = track[i + 1].world_from_camera.translation;
    if (!there.allFinite()) continue;
    const int steps = static_cast<int>(std::ceil((there - here).norm() / kCheckStepMm));
    for (int k = 1; k < steps; ++k)
      require(here + (there - here) * (double(k) / steps), i, "after");
  }
}

}  // namespace rugae
