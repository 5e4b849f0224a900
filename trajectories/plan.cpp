#include <algorithm>
#include <cmath>
#include <optional>

#include "core/check.h"
#include "trajectories/course.h"
#include "trajectories/path.h"
#include "trajectories/time_law.h"

namespace rugae {
namespace {

constexpr double kControlStepMm = 1.5;     // of the spline's control points, on the mean
constexpr int kAxisPoints = 67;            // of the tube: 64 spans
constexpr double kLengthTolerance = 1e-7;  // relative; 0.1 % is asked for
// Ends of the tube are where the room beyond the clearance falls below this share of the most
// there is: the narrow stubs of oesophagus and duodenum are left out.
constexpr double kEndRoomShare = 0.12;
constexpr double kEndRoomMm = 1.0;
constexpr double kSmallestLoopMm = 3.0;
constexpr double kLargestLoopShare = 0.5;  // of the tube's widest free extent
constexpr int kMostLoops = 12;             // times those asked for
constexpr double kWallDistanceMm = 30.0;   // typical, from the camera along its axis
constexpr double kMostPasses = 2000.0;

/// tau of control point k: the spline begins at the second and ends at the last but one.
double tau_of(int k, int count) { return (k - 1.0) / (count - 3.0); }

/// What is steady, or bursts, is the motion of the picture: a turn by one radian moves the picture
/// of a wall d mm away as far as a step of d mm to the side does. So the capsule slows down where
/// it turns: d travelled = sqrt(|dp|^2 + (d |dtheta|)^2), by (root mean square) composition since
/// the two may point anywhere.
Travel picture_motion(const PlannedPath::Impl& impl) {
  return {static_cast<int>(impl.positions.size()) - 3,
          [positions = impl.positions, rotations = impl.rotations](double u) {
            return Vec2(spline_slope(positions, u).norm(),
                        kWallDistanceMm * spline_turn_rate(rotations, u).norm())
                .norm();
          }};
}

class LengthFit {
 public:
  LengthFit(const Tube& tube, const Course& course, const TrajectoryOptions& options)
      : tube_(tube),
        course_(course),
        options_(options),
        target_mm_(10.0 * options.length_cm),
        controls_(static_cast<int>(std::ceil(target_mm_ / kControlStepMm)) + 8) {}

  /// Passes, loops and their radius such that the path has its length; the size that came nearest
  /// if there is none.
  struct Fit {
    CourseSize size;
    bool found;
  };
  Fit fit() const {
    CourseSize size;
    if (options_.loops.count > 0) {
      for (size.passes = options_.passes; size.passes >= 1.0; size.passes -= 1.0)
        if (const auto fit = fit_loops(size)) return *fit;
      // Too short a path even for one pass with small loops: it goes without them.
    }
    size = {1.0, 0, 0.0, 1.0};
    if (length(size) > target_mm_) return solve(size, size.reach, 0.0, 1.0);
    return solve(size, size.passes, 1.0, kMostPasses);
  }

  std::vector<Vec3> positions(const CourseSize& size) const {
    std::vector<Vec3> points;
    for (int k = 0; k < controls_; ++k)
      points.push_back(course_.position(size, tau_of(k, controls_)));
    return points;
  }
  std::vector<Quat> rotations(const CourseSize& size) const {
    std::vector<Quat> list;
    for (int k = 0; k < controls_; ++k)
      list.push_back(course_.world_from_camera(size, tau_of(k, controls_)).rotation);
    return list;
  }
  double length(const CourseSize& size) const { return arc_length(positions(size)).total(); }

 private:
  /// Empty when even small loops, or none, make the passes too long.
  std::optional<Fit> fit_loops(CourseSize size) const {
    if (length({size.passes, options_.loops.count, kSmallestLoopMm}) > target_mm_) return {};
    double widest = kSmallestLoopMm;
    for (int i = 0; i <= 16; ++i)
      widest = std::max(widest, kLargestLoopShare * tube_.extent_mm(tube_.length_mm() * i / 16, 0));
    size.loop_mm = widest;
    for (int loops = options_.loops.count; loops <= kMostLoops * options_.loops.count;
         loops += more_loops(loops)) {
      size.loops = loops;
      if (length(size) < target_mm_) continue;
      if (const Fit fit = solve(size, size.loop_mm, 0.0, widest); fit.found) return fit;
      return {};
    }
    return Fit{size, false};
  }

  /// An eighth more, whole stations.
  int more_loops(int loops) const {
    const int each = options_.loops.per_station;
    return std::max(1, loops / (8 * each)) * each;
  }

  /// Bisection on one member of `size`, from low (too short) to high (too long).
  Fit solve(CourseSize& size, double& member, double low, double high) const {
    member = high;
    if (!(length(size) >= target_mm_)) return {size, false};
    member = low;
    if (!(length(size) <= target_mm_)) return {size, false};
    constexpr int kMaxRounds = 100;
    for (int round = 0; round < kMaxRounds; ++round) {
      member = 0.5 * (low + high);
      const double now = length(size);
      if (std::abs(now - target_mm_) <= kLengthTolerance * target_mm_) break;
      (now > target_mm_ ? high : low) = member;
    }
    return {size, true};
  }

  const Tube& tube_;
  const Course& course_;
  const TrajectoryOptions& options_;
  double target_mm_;
  int controls_;
};

PlannedPath::Impl plan_in(const FreeSpace& space, const TrajectoryOptions& options,
                          std::uint64_t seed) {
  const double widest = space.widest_mm();
  check(widest >= options.clearance_mm + kEndRoomMm,
        "trajectory '{}' would leave the stomach: it asks for a clearance of {} mm, but the "
        "roomiest place, near {}, is {:.1f} mm from the wall",
        options.name, options.clearance_mm, place_text(space.widest_point()), widest);
  const double room = widest - options.clearance_mm;
  const auto axis = space.medial_line(
      options.clearance_mm + std::max(kEndRoomMm, kEndRoomShare * room), kAxisPoints);

  // The tube is measured at stations and the wall between them may come nearer: where the path
  // then has too little room, the whole tube is drawn in by what is missing.
  constexpr int kMaxRounds = 8;
  constexpr double kMarginMm = 0.1;
  double keep_mm = options.clearance_mm + kMarginMm;
  Clearance found;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Tube tube(space, axis, keep_mm);
    const Course course(tube, options, seed);
    const LengthFit lengths(tube, course, options);
    const auto [size, fits] = lengths.fit();
    check(fits,
          "trajectory '{}' would leave the stomach: {} cm do not fit with a clearance of {} mm; "
          "the longest way found is {:.1f} cm, and the roomiest place, near {}, is {:.1f} mm from "
          "the wall",
          options.name, options.length_cm, options.clearance_mm, lengths.length(size) / 10.0,
          place_text(space.widest_point()), widest);
    PlannedPath::Impl impl;
    impl.positions = lengths.positions(size);
    const Travel arc = arc_length(impl.positions);
    found = least_clearance(space, impl.positions, arc);
    if (found.least_mm >= options.clearance_mm) {
      impl.rotations = lengths.rotations(size);
      impl.length_mm = arc.total();
      impl.min_clearance_mm = found.least_mm;
      const TimeLaw law(options.pace, seed);
      impl.parameter_at = [law, motion = picture_motion(impl)](double fraction) {
        return motion.parameter(motion.total() * law.share(fraction));
      };
      return impl;
    }
    keep_mm += options.clearance_mm - found.least_mm + kMarginMm;
  }
  require_clearance(found, options.clearance_mm, options.name);
  return {};
}

}  // namespace

PlannedPath plan_path(const TriangleMesh& wall, const TrajectoryOptions& options,
                      std::uint64_t seed) {
  options.check("trajectory '" + options.name + "'");
  check_mesh(wall, "trajectory '" + options.name + "': the wall");
  check(signed_volume_mm3(wall) > 0.0,
        "trajectory '{}': the wall encloses a volume of {:.0f} mm^3; expected a closed mesh whose "
        "normals point outward",
        options.name, signed_volume_mm3(wall));
  const EdgeReport edges = inspect_edges(wall);
  check(edges.open == 0,
        "trajectory '{}': the wall has {} open edges, expected a closed mesh: nothing else has an "
        "inside",
        options.name, edges.open);
  const FreeSpace space(wall);
  if (options.file.empty())
    return PlannedPath(std::make_shared<const PlannedPath::Impl>(plan_in(space, options, seed)));

  auto impl = follow_track(read_tum(options.file), options.file.string());
  const Clearance found = least_clearance(space, impl.positions, arc_length(impl.positions));
  require_clearance(found, options.clearance_mm, options.name);
  impl.min_clearance_mm = found.least_mm;
  return PlannedPath(std::make_shared<const PlannedPath::Impl>(std::move(impl)));
}

}  // namespace rugae
