#include "recon/rolling_shutter.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace rugae {
namespace {

constexpr double kSettledPx = 1e-6;  // of the row whose time puts a point on it
constexpr int kSteps = 30;

// cam(dt)_from_cam as turn and shift.
struct Step {
  double dt_s;
  Vec3 turn, shift;
};

Step step_between(const Rigid3& from, const Rigid3& to, double dt_s) {
  const Rigid3 moved = to * from.inverse();
  const Eigen::AngleAxisd turn(moved.rotation);
  return {dt_s, turn.angle() * turn.axis(), moved.translation};
}

}  // namespace

Rigid3 CameraMotion::after(double dt_s) const {
  const Vec3 turn = dt_s * turn_rad_per_s;
  const double angle = turn.norm();
  const Quat rotation =
      angle > 0.0 ? Quat(Eigen::AngleAxisd(angle, turn / angle)) : Quat::Identity();
  return {rotation, dt_s * shift_per_s};
}

std::vector<CameraMotion> motions_of(const std::vector<std::optional<Rigid3>>& cam_from_world,
                                     const std::vector<double>& times_s) {
  check(cam_from_world.size() == times_s.size(), "motions_of: {} poses, {} times",
        cam_from_world.size(), times_s.size());
  std::vector<CameraMotion> motions(cam_from_world.size());
  std::vector<std::size_t> posed;
  for (std::size_t i = 0; i < cam_from_world.size(); ++i)
    if (cam_from_world[i]) posed.push_back(i);
  const auto step = [&](std::size_t from, std::size_t to) {
    return step_between(*cam_from_world[posed[from]], *cam_from_world[posed[to]],
                        times_s[posed[to]] - times_s[posed[from]]);
  };
  for (std::size_t k = 0; k < posed.size(); ++k) {
    if (posed.size() < 2) break;
    CameraMotion& motion = motions[posed[k]];
    // The nearest two others: one on either side, but at an end.
    const std::size_t last = posed.size() - 1;
    const Step one = step(k, k < last ? k + 1 : k - 1);
    if (posed.size() == 2) {
      motion = {one.turn / one.dt_s, one.shift / one.dt_s};
      continue;
    }
    const Step other = step(k, k == 0 ? 2 : k == last ? k - 2 : k - 1);
    // a of x(t) = a t + b t^2 through both.
    const double between_s = other.dt_s - one.dt_s;
    const double of_one = other.dt_s / (one.dt_s * between_s);
    const double of_other = -one.dt_s / (other.dt_s * between_s);
    motion = {of_one * one.turn + of_other * other.turn,
              of_one * one.shift + of_other * other.shift};
  }
  return motions;
}

RollingShutter::RollingShutter(const Lens& lens, const Lens& original, double row_time_s)
    : lens_(lens),
      original_(original),
      straight_projector_(lens),
      original_projector_(original),
      row_time_s_(row_time_s) {}

double RollingShutter::offset_s(const Vec3& p_cam) const {
  if (!rolling()) return 0.0;
  const auto pixel = original_projector_.project(p_cam);
  const double height = original_.height;
  // Outside the sensor's view time holds.
  const double row = pixel ? std::clamp(pixel->y(), 0.0, height) : 0.5 * height;
  return row_time_s_ * (row - 0.5 * height);
}

std::optional<Vec3> RollingShutter::when_seen(const Vec3& p_cam, const CameraMotion& motion) const {
  if (!rolling()) return p_cam;
  // The image moves by a fraction of a row while a row is read, so this contracts.
  double dt_s = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    const Vec3 seen = motion.after(dt_s) * p_cam;
    if (!(seen.z() > 0.0)) return std::nullopt;
    const double next_s = offset_s(seen);
    if (std::abs(next_s - dt_s) <= kSettledPx * row_time_s_) return seen;
    dt_s = next_s;
  }
  return std::nullopt;
}

std::optional<Vec2> RollingShutter::project(const Vec3& p_cam, const CameraMotion& motion) const {
  const auto seen = when_seen(p_cam, motion);
  return seen ? straight_projector_.project(*seen) : std::nullopt;
}

Vec2 RollingShutter::ray_at_frame_time(const Vec2& ray, double depth,
                                       const CameraMotion& motion) const {
  if (!rolling()) return ray;
  const Vec3 seen(ray.x(), ray.y(), 1.0);
  const Rigid3 back = motion.after(offset_s(seen)).inverse();
  // How far it was when it was seen follows from its depth at the frame's time.
  const Vec3 direction = back.rotation * seen;
  const double seen_depth = (depth - back.translation.z()) / direction.z();
  if (!(direction.z() > 0.0 && seen_depth > 0.0 && depth > 0.0)) return ray;
  return (seen_depth * direction + back.translation).head<2>() / depth;
}

}  // namespace rugae
