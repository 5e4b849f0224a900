#pragma once
// A capsule's path inside a cavity: a smooth SE(3) spline planned from the wall itself.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/mesh.h"
#include "core/pose_track.h"
#include "trajectories/board_views.h"

namespace rugae {

enum class LoopShape { circle, eight, knot };

/// Local loops around a place: each place ("station") is circled `per_station` times before the
/// path moves on, so that it is seen again from the same side after a short loop.
struct LoopOptions {
  int count = 0;  // over the whole path; more are taken where a stomach is too small for so few
  int per_station = 1;
  LoopShape shape = LoopShape::circle;
};

/// Where the camera looks: obliquely at the wall, with slow sways to the sides.
struct ViewOptions {
  double tilt_rad = 0.4;     // from straight at the wall towards the far end
  double sway_rad = 0.0;     // largest turn to the sides
  double sway_cycles = 0.0;  // over the whole path
};

/// How the speed varies: a steady one, and bursts of `peak_speed` times the mean.
struct PaceOptions {
  double peak_speed = 1.0;   // largest speed over the mean speed
  int bursts = 0;            // over the whole path
  double burst_share = 0.1;  // of the duration spent in bursts (full width at half height)
};

struct TrajectoryOptions {
  std::string name;            // "1" to "6", or the file's stem
  int paper_number = 0;        // 1 to 6, 0 for others
  std::filesystem::path file;  // a track (TUM format, mm) to follow instead of a planned path
  double length_cm = 120.0;    // of the camera centre's path
  double clearance_mm = 6.0;   // least distance of the camera centre to the wall
  int passes = 2;  // runs from end to end; without loops the length decides their number
  double winding_turns = 1.0;  // of the viewing direction around the axis, over the whole path
  bool retrace = false;        // the second half goes back along the way of the first
  double offset_share = 0.3;   // of the way from the axis to the free space's edge
  LoopOptions loops;
  ViewOptions view;
  PaceOptions pace;
  double read_noise_factor = 1.0;  // trajectory 5: added sensor noise
  double oil = 0.0;                // trajectory 6: oil on the wall
  BoardViewOptions board;          // with a count above 0: a stop-motion around a board
  /// Throws Error naming `where` and the field that is out of range.
  void check(const std::string& where) const;
};

/// A preset name ("1" to "6") or a YAML file. The key `like` names the trajectory whose values are
/// taken where the file has none; `file` is relative to the YAML file. Throws Error with file, line
/// and column.
TrajectoryOptions load_trajectory(const std::string& name_or_path);

/// The planned path, a function of the fraction of its duration.
class PlannedPath {
 public:
  /// Pose at `fraction` in [0, 1] of the duration; the speed along the path varies as planned.
  /// Position and orientation have continuous second derivatives along the path.
  Rigid3 world_from_camera(double fraction) const;
  double length_mm() const;         // of the centre's path, by quadrature to 1e-6
  double min_clearance_mm() const;  // over the whole path, checked at steps of at most 0.25 mm

  struct Impl;
  explicit PlannedPath(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Plans the path from the closed wall mesh (outward normals). The same mesh, options and seed give
/// the same path for any number of threads; name, noise and oil do not matter to it. Throws Error
/// "trajectory '4' would leave the stomach: ..." when no path of that length and clearance fits,
/// naming the place and the clearance found.
PlannedPath plan_path(const TriangleMesh& wall, const TrajectoryOptions& options,
                      std::uint64_t seed);

/// The pose at `fraction` (held at the ends beyond [0, 1]), rounded to 1e-9 mm and 1e-12, below
/// which planning means nothing.
Rigid3 sampled_pose(const PlannedPath& path, double fraction);

/// `frames` poses at equal steps of time over the whole path, the first at its start and the last
/// at its end. Times are index / fps: the path is always the whole one, so fewer frames mean a
/// faster capsule. Throws Error for fewer than two frames or a rate that is not positive.
PoseTrack sample_path(const PlannedPath& path, int frames, double fps);

/// Checks a track of any origin (a user's file) against the wall, along the straight lines between
/// its poses too: throws Error naming the first pose outside or too near.
void check_inside(const TriangleMesh& wall, const PoseTrack& track, double clearance_mm,
                  const std::string& name);

}  // namespace rugae
