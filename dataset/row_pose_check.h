#pragma once
// With a rolling shutter the pose of a frame is that of its middle row: do trajectory.txt and
// row_poses/ say the same?

#include "cameras/camera.h"
#include "core/pose_track.h"
#include "dataset/layout.h"
#include "dataset/problem_list.h"

namespace rugae {

/// Notes the first frame whose pose is not that of its middle row, and the usual mistake that
/// explains all such frames where one does. Files that cannot be read are left to others.
void check_row_poses(const DatasetLayout& layout, const Camera& camera, const PoseTrack& track,
                     ProblemList& problems);

}  // namespace rugae
