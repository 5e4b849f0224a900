#pragma once
// Errors of an estimated camera path.

#include <optional>
#include <string>
#include <vector>

#include "validate/align.h"
#include "validate/error_stats.h"

namespace rugae {

/// Absolute errors after one alignment of the whole path. ATE: Sturm et al., A benchmark for the
/// evaluation of RGB-D SLAM systems, IROS 2012, section V.B, doi:10.1109/IROS.2012.6385773.
struct AbsoluteError {
  Sim3 truth_from_estimate;
  ErrorStats position_mm;   // of the camera centres; rmse is the ATE
  ErrorStats rotation_rad;  // angle between true and aligned orientation
  std::vector<double> position_of_pose_mm, rotation_of_pose_rad;  // in the order of the pairs
};

/// Empty when the alignment is not determined (see align_tracks).
std::optional<AbsoluteError> absolute_error(const TrackPair& pair, Alignment alignment);

/// Relative errors over a step: the motion of the estimate (its lengths times `scale`) against the
/// true motion, E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j) (Sturm et al. 2012, section V.A).
struct RelativeError {
  ErrorStats translation_mm, rotation_rad;
  std::size_t possible = 0;  // steps of the truth; those with a lost end are counted here alone
};

/// `estimate[i]` belongs to truth[i], empty where lost. The steps run from i to `end_of_step[i]`;
/// an end of -1 means that the path ends before the step does.
RelativeError relative_error(const std::vector<Rigid3>& truth,
                             const std::vector<std::optional<Rigid3>>& estimate, double scale,
                             const std::vector<int>& end_of_step);

/// From each pose to the next `frames` later.
std::vector<int> steps_of_frames(std::size_t poses, int frames);
/// From each pose to the one nearest in time to `seconds` later; -1 where none is within half a
/// frame of it.
std::vector<int> steps_of_time(const PoseTrack& truth, double seconds);
/// From each pose to the first one at least `path_mm` further along the true path.
std::vector<int> steps_of_path(const PoseTrack& truth, double path_mm);

/// Everything about a path. A lost frame is counted, never skipped: `tracked` against `frames`.
struct PoseErrors {
  int frames = 0, tracked = 0;
  double tracked_share = 0.0;
  double length_mm = 0.0;                  // of the true path
  std::optional<AbsoluteError> se3, sim3;  // empty when too few frames are tracked: see `note`
  RelativeError per_frame, per_second, per_10mm;  // lengths scaled by the Sim(3) alignment
  std::string note;                               // why something is missing; empty when nothing is
};

/// `estimate` has the poses of the tracked frames; its times are among the times of `truth`, which
/// has every frame.
PoseErrors pose_errors(const PoseTrack& truth, const PoseTrack& estimate);

}  // namespace rugae
