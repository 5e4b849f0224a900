#pragma once
// A wall patch found in a frame: a coarse search around where it should be, then registration to a
// fraction of a pixel.

#include <opencv2/core/mat.hpp>
#include <optional>

#include "recon/dense/wall_patch.h"
#include "recon/refine.h"

namespace rugae {

/// Calls are thread-safe.
class PatchRegistrar {
 public:
  /// Of frames seen through this lens.
  explicit PatchRegistrar(const Lens& lens);

  /// The pixel within `reach_px` of the foretold one where the patch, bent as foretold, fits best
  /// (normalised correlation at a quarter of 640 px width), to a few pixels. Empty where it fits
  /// nowhere, and for patches near their anchor's border.
  std::optional<Vec2> search(const WallPatch& patch, const PatchSight& sight,
                             const PatchImage& image, double reach_px) const;
  /// From a start within a few pixels to the place itself; empty where the patch does not look
  /// like the frame, its texture does not fix the place, or a reflection lies there.
  std::optional<Vec2> settle(const WallPatch& patch, const PatchSight& sight,
                             const PatchImage& image, const Vec2& start) const;
  /// Both.
  std::optional<Vec2> find(const WallPatch& patch, const PatchSight& sight, const PatchImage& image,
                           double reach_px) const;

 private:
  PointRefiner refiner_;
};

}  // namespace rugae
