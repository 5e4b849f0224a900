#pragma once
// Which key frames form a local mosaic, and by which homography each lands on its anchor.

#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "recon/align.h"
#include "recon/options.h"
#include "recon/structure.h"

namespace rugae {

struct MosaicMember {
  int keyframe = -1;                           // position in the list of key frames
  Mat3 anchor_from_member = Mat3::Identity();  // homography of pixels, (0.5, 0.5) convention
};

struct MosaicPlan {
  int anchor = -1;                    // key frame position
  std::vector<MosaicMember> members;  // the anchor first
};

/// The part of the anchor's image plane a mosaic may cover, in anchor pixels.
Eigen::AlignedBox2d mosaic_bounds(const Lens& lens);

/// The frame's outline on the anchor's plane; empty when the homography is degenerate: it folds the
/// frame over, scales its area or shears its corners by more than a factor stated in the source, or
/// puts more than half of the frame outside the bounds of the mosaic.
std::optional<std::vector<Vec2>> outline_on_anchor(const Mat3& anchor_from_member,
                                                   const Lens& lens);

/// Every placed key frame is a member of some mosaic. Anchors are chosen greedily, the one that
/// brings most key frames not yet covered first, of equals the most central one. A member is
/// reached from its anchor by a chain of aligned pairs through members (fewest links, then most
/// inliers), looks within options.max_view_angle_rad of the anchor's view, and its homography is
/// not degenerate.
std::vector<MosaicPlan> plan_mosaics(const Structure& structure,
                                     const std::vector<PairAlignment>& pairs, const Lens& lens,
                                     const MosaicOptions& options);

}  // namespace rugae
