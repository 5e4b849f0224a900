#pragma once
// Brings an estimate into the world of the truth: by the trajectory, and by the surface.

#include <optional>
#include <vector>

#include "core/mesh.h"
#include "core/pose_track.h"
#include "core/sim3.h"

namespace rugae {

/// The same moments of two tracks; all three lists have one length. Poses are world_from_camera,
/// each in the world of its own track.
struct TrackPair {
  std::vector<double> time_s;
  std::vector<Rigid3> truth, estimate;
  std::size_t size() const { return time_s.size(); }
};

/// Pairs every pose of the estimate with the truth interpolated at its time; poses outside the time
/// of the truth are left out. Throws Error when a pose is not finite.
TrackPair associate(const PoseTrack& truth, const PoseTrack& estimate);

enum class Alignment { se3, sim3 };

/// truth_from_estimate over the camera centres (Umeyama 1991); the scale is 1 for SE(3). Empty with
/// fewer than three pairs, or when all centres lie on one line.
std::optional<Sim3> align_tracks(const TrackPair& pair, Alignment alignment);

struct IcpOptions {
  double max_distance_mm = 50.0;  // pairs farther apart are not used
  int max_iterations = 50;
  bool with_scale = false;  // the scale then may only leave 1 by a factor of 2, see below
  void check() const;
};

struct IcpResult {
  Sim3 target_from_source;  // to be applied to the source as given
  double rmse_mm = 0.0;     // of the pairs used
  double used_share = 0.0;  // of the source points
  bool converged = false;   // pairs were found, and the scale stayed within a factor of 2
};

/// Point-to-point ICP (Besl and McKay 1992, doi:10.1109/34.121791) by Open3D, started where the
/// points are. One-sided ICP with a free scale can shrink the source onto a single target point, so
/// a scale beyond a factor of 2 is reported as not converged. The same points give the same result
/// for any number of threads.
IcpResult icp(const std::vector<Vec3>& source, const std::vector<Vec3>& target,
              const IcpOptions& options);

/// The mesh moved; normals turned.
TriangleMesh transformed(const TriangleMesh& mesh, const Sim3& target_from_mesh);

}  // namespace rugae
