#pragma once
// A camera path as samples in time, its interpolation, and the association of two paths by time.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/rigid3.h"

namespace rugae {

struct TimedPose {
  double time_s = 0.0;
  Rigid3 world_from_camera;
};

using PoseTrack = std::vector<TimedPose>;

/// The pose at `time_s`: translation linear, rotation by slerp between the neighbours; empty
/// outside the track. The track's times must ascend.
std::optional<Rigid3> interpolate(const PoseTrack& track, double time_s);

/// Length of the polyline through the positions, mm.
double length_mm(const PoseTrack& track);

/// Reads "time tx ty tz qx qy qz qw" lines (TUM RGB-D format); '#' starts a comment. Throws Error
/// with file and line on a malformed line, a value that is not finite, a quaternion off unit norm
/// by more than 1e-3, or times that do not ascend.
PoseTrack read_tum(const std::filesystem::path& file);

/// The same format with 17 significant digits, so that reading gives back the same doubles.
std::string tum_text(const PoseTrack& track);

}  // namespace rugae
