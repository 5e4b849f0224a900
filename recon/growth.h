#pragma once
// One segment of a structure grown from its best pair: key frame after key frame by resection, new
// points by triangulation, adjustment as it goes.

#include <vector>

#include "core/progress.h"
#include "recon/options.h"
#include "recon/structure.h"

namespace rugae {

/// Grows a segment among the key frames that `available` marks; `structure` holds frames and tracks
/// (with rays), and after the call the poses of those that were placed and the points. False when
/// no pair of them can start it (then nothing is placed).
bool grow_segment(Structure& structure, const std::vector<char>& available, double focal_px,
                  const BundleOptions& options, Progress& progress);

/// Triangulates every track that has no point yet and judges all observations anew: an observation
/// off its point by more than `max_px` is marked, a point that is left with fewer than two or with
/// too little parallax is given up.
void update_points(Structure& structure, double focal_px, double max_px,
                   const BundleOptions& options);

/// All poses and points jointly, judging the observations between rounds.
void adjust_all(Structure& structure, double focal_px, const BundleOptions& options, int rounds,
                double function_tolerance);

}  // namespace rugae
