#pragma once
// One segment of a structure grown from its best pair: key frame after key frame by resection, new
// points by triangulation, adjustment as it goes.

#include <vector>

#include "core/progress.h"
#include "recon/options.h"
#include "recon/structure.h"

namespace rugae {

/// `structure` holds frames and tracks (with rays), and its poses and points are set; of its tracks
/// and frames more may come between calls.
class SegmentGrowth {
 public:
  SegmentGrowth(Structure& structure, double focal_px, const BundleOptions& options);

  /// With the best pair among the key frames that `available` marks. False, and nothing is placed,
  /// when no pair of them can start it.
  bool begin(const std::vector<char>& available);
  /// Places every key frame among those available that sees enough known points, the one that sees
  /// most first.
  void extend(const std::vector<char>& available, Progress& progress);

 private:
  void adjust_globally();

  Structure& structure_;
  double focal_px_;
  BundleOptions options_;
  int placed_ = 0, placed_at_global_ = 0;
  std::vector<int> tried_;  // of each key frame: with how many points it failed
};

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
