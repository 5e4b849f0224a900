#include "trajectories/course.h"

#include <algorithm>
#include <cmath>

#include "core/portable_math.h"
#include "core/random.h"
#include "trajectories/channels.h"
#include "trajectories/spline.h"

namespace rugae {
namespace {

// Around a station the way to the next slows down to this share of its mean speed, so that a second
// loop follows the first closely.
constexpr double kLinger = 0.9;
// Loops of one path differ in size by this share.
constexpr double kLoopSizeSpread = 0.25;
// While it circles, the camera turns so as to keep looking at the same patch of the wall, about so
// far away, by this share of the whole turn.
constexpr double kPatchDistanceMm = 30.0;
constexpr double kFixation = 0.6;
// The camera never looks farther than this from straight at the wall towards either end: down the
// lumen the wall is far away and dark.
constexpr double kMostAlongRad = rad_from_deg(40.0);
// Sways along the axis are smaller than those around it.
constexpr double kSwayAlong = 0.6;
constexpr double kSteadyEnds = 0.8;
// The way out lies by this share farther from the axis, the way back by as much nearer to it, so
// that the turn between them is wide.
constexpr double kOutAndBack = 0.6;
// Values of the random splines a cycle.
constexpr double kValuesPerCycle = 2.0;

double sine(double angle_rad) { return portable_sin_cos(angle_rad).sine; }
double cosine(double angle_rad) { return portable_sin_cos(angle_rad).cosine; }
double arcsine(double x) { return portable_atan2(x, std::sqrt((1.0 - x) * (1.0 + x))); }

/// A triangle wave with rounded corners: 0 at even v, 1 at odd v; a sharpness of 1 has corners.
double to_and_fro(double v, double sharpness) {
  return 0.5 - 0.5 * arcsine(sharpness * cosine(kPi * v)) / arcsine(sharpness);
}
constexpr double kSharpnessAlong = 0.9;
constexpr double kSharpnessRetracing = 0.99;

/// A square wave with rounded edges: near 1 between 0 and 1, near -1 between 1 and 2.
double out_or_back(double v) {
  constexpr double kRounding = 0.3;
  const double s = sine(kPi * v);
  return s / std::sqrt(s * s + kRounding * kRounding);
}

std::vector<double> random_values(std::uint64_t seed, std::uint32_t channel, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i)
    values.push_back(2.0 * random_uniform(seed, Purpose::trajectory, channel, i)[0] - 1.0);
  return values;
}

}  // namespace

Course::Course(const Tube& tube, const TrajectoryOptions& options, std::uint64_t seed)
    : tube_(tube), options_(options) {
  const auto u = random_uniform(seed, Purpose::trajectory, kChannelStart, 0);
  start_rad_ = 2.0 * kPi * u[0];
  hand_ = u[1] < 0.5 ? -1.0 : 1.0;
  from_far_end_ = u[2] < 0.5;
  const auto p = random_uniform(seed, Purpose::trajectory, kChannelLoopPhase, 0);
  phases_ = 2.0 * kPi * Vec3(p[0], p[1], p[2]);
  const int sways = static_cast<int>(std::ceil(kValuesPerCycle * options.view.sway_cycles)) + 4;
  sway_around_ = random_values(seed, kChannelSwayAround, sways);
  sway_along_ = random_values(seed, kChannelSwayAlong, sways);
  const int stations = options.loops.count / std::max(options.loops.per_station, 1);
  loop_size_ = random_values(seed, kChannelLoopSize, stations + 4);
}

double Course::noise(const std::vector<double>& values, double tau) const {
  return spline_value(values, tau * (static_cast<double>(values.size()) - 3.0));
}

Course::Place Course::place(const CourseSize& size, double tau) const {
  double progress = tau;
  if (size.loops > 0) {
    const double stations = double(size.loops) / options_.loops.per_station;
    const double x = tau * stations;
    progress = (x - kLinger * sine(2.0 * kPi * x) / (2.0 * kPi)) / stations;
  }
  const double way = options_.retrace ? to_and_fro(2.0 * progress, kSharpnessRetracing) : progress;
  const double v = size.passes * (options_.retrace ? 0.5 : 1.0) * way;
  double share = to_and_fro(v, kSharpnessAlong);
  if (from_far_end_) share = 1.0 - share;

  Place at{};
  const double room = std::min(size.loop_mm, 0.25 * tube_.length_mm());
  const double length = std::max(tube_.length_mm() - 2.0 * room, 0.0) * size.reach;
  at.along_mm = 0.5 * tube_.length_mm() + (share - 0.5) * length;
  // Without loops the direction turns between the ends and hardly at them, where the path turns.
  const double turned =
      size.loops > 0 ? way : way - kSteadyEnds * sine(2.0 * kPi * v) / (2.0 * kPi * size.passes);
  at.around_rad = start_rad_ + hand_ * 2.0 * kPi * options_.winding_turns * size.reach * turned;

  at.offset_share = options_.offset_share * (1.0 + kOutAndBack * out_or_back(v));
  if (size.loops > 0) {
    const double psi = 2.0 * kPi * size.loops * tau;
    const double a = size.loop_mm * (1.0 + kLoopSizeSpread * noise(loop_size_, tau));
    switch (options_.loops.shape) {
      case LoopShape::circle:
        at.shift_along_mm = a * sine(psi);
        at.shift_around_mm = a * cosine(psi);
        break;
      case LoopShape::eight:
        at.shift_along_mm = a * sine(psi);
        at.shift_around_mm = 0.8 * a * sine(2.0 * psi + phases_[0]);
        at.shift_away_mm = 0.4 * a * cosine(psi + phases_[1]);
        break;
      case LoopShape::knot:
        at.shift_along_mm = a * (0.8 * sine(psi) + 0.4 * sine(3.0 * psi + phases_[0]));
        at.shift_around_mm = a * (0.8 * cosine(psi) + 0.4 * sine(2.0 * psi + phases_[1]));
        at.shift_away_mm = 0.5 * a * sine(2.0 * psi + phases_[2]);
        break;
    }
  }
  return at;
}

Vec3 Course::point(const Place& at) const {
  const double along = std::clamp(at.along_mm + at.shift_along_mm, 0.0, tube_.length_mm());
  const Vec2 outward(cosine(at.around_rad), sine(at.around_rad));
  const Vec2 around(-outward.y(), outward.x());
  const double offset =
      at.offset_share * tube_.extent_mm(at.along_mm, at.around_rad) + at.shift_away_mm;
  return tube_.point(along, offset * outward + at.shift_around_mm * around);
}

Vec3 Course::position(const CourseSize& size, double tau) const { return point(place(size, tau)); }

Rigid3 Course::world_from_camera(const CourseSize& size, double tau) const {
  const Place at = place(size, tau);
  const ViewOptions& view = options_.view;
  const double around = at.around_rad + view.sway_rad * noise(sway_around_, tau) -
                        kFixation * at.shift_around_mm / kPatchDistanceMm;
  const double wanted = view.tilt_rad + kSwayAlong * view.sway_rad * noise(sway_along_, tau) -
                        kFixation * at.shift_along_mm / kPatchDistanceMm;
  const double along = kMostAlongRad * portable_tanh(wanted / kMostAlongRad);
  // The camera's axes in the tube's frame: z looks to the side and by `along` towards the far end;
  // the picture's up (-y) is the way to the far end, so that places seen again are seen upright
  // again.
  const double c = cosine(along), s = sine(along);
  const Vec3 z(c * cosine(around), c * sine(around), s);
  const Vec3 down(s * cosine(around), s * sine(around), -c);
  Mat3 tube_from_camera;
  tube_from_camera << down.cross(z), down, z;
  const Quat rotation = tube_.frame(at.along_mm) * Quat(tube_from_camera);
  return {rotation.normalized(), point(at)};
}

}  // namespace rugae
