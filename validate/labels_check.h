#pragma once
// Do the labels of two frames agree with each other and with the poses?

#include "cameras/camera.h"
#include "core/rigid3.h"
#include "dataset/truth.h"
#include "validate/error_stats.h"

namespace rugae {

struct LabelsCheck {
  std::size_t pixels = 0;  // with flow, looked at
  ErrorStats flow_px;      // flow against the reprojection of depth
  // |depth of the next frame where the flow leads - depth reprojected| for pixels not marked
  // occluded, over the depth: the next frame's depth is bilinear.
  ErrorStats depth_share;
  std::size_t unit_normals = 0, facing_normals = 0;  // of the pixels looked at
};

/// Every `step`-th pixel in x and y with valid depth and flow: lift by depth, move to the next
/// frame, project, compare. `now` has flow to `next`.
LabelsCheck check_labels(const Lens& lens, const Rigid3& world_from_now,
                         const Rigid3& world_from_next, const FrameTruth& now,
                         const FrameTruth& next, int step = 4);

}  // namespace rugae
