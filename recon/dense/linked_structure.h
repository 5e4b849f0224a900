#pragma once
// Poses of the key frames and points, in the dense method.

#include <vector>

#include "core/progress.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"

namespace rugae {

/// Segments are grown along the chain of key frames, the largest is linked to itself wherever it
/// sees the same wall again, the others are looked for in it, and all is linked and adjusted.
/// Without rounds of revisits: build_structure().
Structure build_linked_structure(const FrameSource& frames, const std::vector<int>& keyframes,
                                 std::vector<Track> tracks, const RevisitOptions& options,
                                 const BundleOptions& bundle, Progress& progress);

}  // namespace rugae
