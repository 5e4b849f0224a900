#pragma once
// A frame's place in the map, by the wall patches that are found in it.

#include <optional>
#include <vector>

#include "recon/dense/register_patch.h"
#include "recon/options.h"
#include "recon/resection.h"
#include "recon/rolling_shutter.h"

namespace rugae {

/// Each patch is looked for within `search_px` (at 640 px width) of where a camera at `guess` would
/// see it; the pose is the one that most of those found agree on (place_by_points). Empty when too
/// few do.
std::optional<Placement> place_by_patches(const std::vector<const WallPatch*>& patches,
                                          const PatchImage& image, const MovingPose& guess,
                                          const PatchRegistrar& registrar,
                                          const RollingShutter& shutter, double search_px,
                                          const BundleOptions& options);

}  // namespace rugae
