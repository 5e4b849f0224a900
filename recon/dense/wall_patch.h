#pragma once
// What is known of the wall around a point: how its anchor key frame saw it, and how it lies in
// space, so that any other key frame's sight of it can be foretold.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "core/rigid3.h"
#include "recon/preprocess/preprocess.h"
#include "recon/refine.h"
#include "recon/structure.h"

namespace rugae {

/// A key frame as patches are cut from it and looked for in it.
struct PatchImage {
  cv::Mat fine;                                   // CV_32F, [0, 1], kFineWidthPx wide at most
  cv::Mat coarse;                                 // CV_8U, light evened out, kCoarseWidthPx wide
  double fine_shrink = 1.0, coarse_shrink = 1.0;  // of the fine and the coarse image
  cv::Mat usable;                                 // CV_8U: wall, no reflection
};

/// A place is found to a tenth of a pixel of these, which is what its texture and the noise allow:
/// the pixels of a wider picture would add time alone.
inline constexpr int kFineWidthPx = 640;
inline constexpr int kCoarseWidthPx = 160;

PatchImage prepare_patch_image(const Frame& frame);

/// By which patches are cut from fine images and registered in them, for this lens.
PointRefinementOptions patch_refinement(const Lens& lens);

/// A piece of wall around a track's point.
struct WallPatch {
  int track = -1, anchor = -1;  // places in Structure::tracks, Structure::frames
  Vec2 anchor_px;
  Vec3 centre;                    // world, map units
  Vec3 along_x, along_y;          // d wall / d pixel of the anchor, on the tangent plane
  Vec3 normal;                    // world, unit length, towards the anchor's camera
  double normal_sigma_rad = 0.0;  // by what the points around stray from the tangent plane
  PointTemplate fine;             // of the anchor's fine image
  cv::Mat coarse;                 // CV_8U square of the anchor's coarse image
  Vec2 coarse_px;                 // the point in it
};

/// How a key frame sees a patch, by geometry alone.
struct PatchSight {
  Vec2 pixel;
  Mat2 linear;  // d pixel / d pixel of the anchor
};

/// Empty when the patch is behind the camera, outside the picture, seen from the other side or too
/// obliquely, or at less than half or more than twice the anchor's scale.
std::optional<PatchSight> foretell(const WallPatch& patch, const MovingPose& camera,
                                   const RollingShutter& shutter);

/// The patches of all triangulated tracks whose tangent plane their anchor's other points fix. The
/// anchor is the track's middle observation: to no other are light, scale and view as similar.
std::vector<WallPatch> make_patches(const FrameSource& frames, const Structure& structure);

}  // namespace rugae
