#pragma once
// Where the chain of key frames broke, and no track leads across, a segment of the path stands in a
// world of its own. The wall it shows has often been seen from elsewhere too, and where it lies
// follows from how the camera moved before and after the break.

#include <optional>
#include <vector>

#include "core/progress.h"
#include "core/sim3.h"
#include "recon/dense/wall_patch.h"
#include "recon/options.h"

namespace rugae {

/// `map` and `segment` have the same key frames and have placed others of them; both are finished.
/// Next to a break the segment's first key frame is where the motion of both sides, going on, has
/// carried the camera, at the scale at which both sides are as fast; turned by some degrees more
/// until `patches` of the map are found in it or one of those behind it. From there on key frame
/// after key frame is placed by patches, and the similarity is the one that their poses agree on.
/// Empty where fewer than three are found, or do not agree.
std::optional<Sim3> map_from_segment(const FrameSource& frames, const Structure& map,
                                     const std::vector<WallPatch>& patches,
                                     const Structure& segment, const RevisitOptions& options,
                                     const BundleOptions& bundle);

/// Moves each of the segments (as build_segments() gives them) that finds its place into the map:
/// key frames, and tracks beside the map's own. Nothing is adjusted or linked. How many were moved.
int rejoin(const FrameSource& frames, std::vector<Structure> segments,
           const RevisitOptions& options, const BundleOptions& bundle, Structure& map,
           Progress& progress);

}  // namespace rugae
