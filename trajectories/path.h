#pragma once
// What a planned path is made of.

#include <functional>
#include <vector>

#include "trajectories/free_space.h"
#include "trajectories/spline.h"
#include "trajectories/trajectory.h"

namespace rugae {

struct PlannedPath::Impl {
  std::vector<Vec3> positions;  // spline control points
  std::vector<Quat> rotations;  // spline control rotations, as many
  double length_mm = 0.0;
  double min_clearance_mm = 0.0;
  std::function<double(double)> parameter_at;  // spline parameter at a fraction of the duration
};

/// Where a path comes nearest to the wall.
struct Clearance {
  double least_mm = 0.0;  // negative outside
  double along_mm = 0.0;  // from the start of the path
  Vec3 place;
};
/// Looks at steps of at most 0.25 mm along the curve of the control points.
Clearance least_clearance(const FreeSpace& space, const std::vector<Vec3>& positions,
                          const Travel& arc);

/// Throws Error "trajectory 'name' would leave the stomach: ..." unless the clearance suffices.
void require_clearance(const Clearance& found, double clearance_mm, const std::string& name);

/// "(1.0, 2.0, 3.0) mm"
std::string place_text(const Vec3& p);

/// The path through the poses of a track file; inside and clearance are not checked here. Speed is
/// continuous, by monotone cubic interpolation of the times.
PlannedPath::Impl follow_track(const PoseTrack& track, const std::string& name);

}  // namespace rugae
