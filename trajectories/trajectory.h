#pragma once
// A capsule's path inside a cavity: a smooth SE(3) spline planned from the wall itself.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/mesh.h"
#include "core/pose_track.h"

namespace rugae {

struct TrajectoryOptions {
  std::string name;               // "1" to "6", or the file's stem
  int paper_number = 0;           // 1 to 6, 0 for others
  double length_cm = 120.0;       // of the camera centre's path
  double clearance_mm = 6.0;      // least distance of the camera centre to the wall
  double look_ahead_share = 0.3;  // 0: looks at the wall only, 1: along the motion
  // ... style: speeds, loops, revisits; see the presets
  double read_noise_factor = 1.0;  // trajectory 5: added sensor noise
  double oil = 0.0;                // trajectory 6: oil on the wall
  void check(const std::string& where) const;
};

/// A preset name ("1" to "6") or a YAML file.
TrajectoryOptions load_trajectory(const std::string& name_or_path);

/// The planned path, a function of the fraction of its duration.
class PlannedPath {
 public:
  /// Pose at `fraction` in [0, 1] of the duration; the speed along the path varies as planned.
  Rigid3 world_from_camera(double fraction) const;
  double length_mm() const;         // of the centre's path, by quadrature to 1e-6
  double min_clearance_mm() const;  // over the whole path, checked at steps of at most 0.25 mm

  struct Impl;
  explicit PlannedPath(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

 private:
  std::shared_ptr<const Impl> impl_;
};

/// Plans the path from the closed wall mesh (outward normals). Throws Error "trajectory '4' would
/// leave the stomach: ..." when no path of that length and clearance fits, naming the place and the
/// clearance found.
PlannedPath plan_path(const TriangleMesh& wall, const TrajectoryOptions& options,
                      std::uint64_t seed);

/// `frames` poses at equal steps of time over the whole path. Times are index / fps: the path is
/// always the whole one, so fewer frames mean a faster capsule.
PoseTrack sample_path(const PlannedPath& path, int frames, double fps);

/// Checks a track of any origin (a user's file) against the wall: throws Error naming the first
/// pose outside or too near.
void check_inside(const TriangleMesh& wall, const PoseTrack& track, double clearance_mm,
                  const std::string& name);

}  // namespace rugae
