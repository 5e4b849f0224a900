#pragma once
// Key frames of a camera that moves while it reads their rows.

#include <vector>

#include "core/progress.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/rolling_shutter.h"
#include "recon/structure.h"

namespace rugae {

/// How each key frame's camera moves, by the poses of the key frames around it.
std::vector<CameraMotion> keyframe_motions(const FrameSource& frames, const Structure& structure);

/// Rays of all observations, of finished structures: those at the frame's time where rows are read
/// one after another.
void set_rays_at_frame_time(const FrameSource& frames, Structure& structure);

/// finish_structure(). With a rolling shutter, rays and poses depend on each other: round after
/// round the rays are set by how the camera moves as far as it is known, and all is adjusted.
void finish_moving(const FrameSource& frames, const BundleOptions& options,
                   const Adjustment& adjustment, Structure& structure, Progress& progress);

}  // namespace rugae
