#pragma once
// Frames placed in the map: the patches that the key frames around a frame see are found in it, and
// its pose is the one that they agree on.

#include <optional>
#include <vector>

#include "core/progress.h"
#include "core/rigid3.h"
#include "recon/dense/wall_patch.h"
#include "recon/options.h"

namespace rugae {

/// Poses of all frames, cam_from_world. Placed key frames keep theirs; the others are looked for
/// around the pose on the way from the key frame before to the one after, then around those of the
/// two, the nearer first. Empty where too few patches agree.
std::vector<std::optional<Rigid3>> place_frames(const FrameSource& frames,
                                                const Structure& structure,
                                                const std::vector<WallPatch>& patches,
                                                const BundleOptions& options, Progress& progress);

}  // namespace rugae
