#pragma once
// Tracks: points of the wall followed from key frame to key frame by pairwise alignment.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "recon/align.h"
#include "recon/keyframes.h"
#include "recon/structure.h"

namespace rugae {

/// Ray (x/z, y/z) of a pixel; empty where the lens has none in front of the camera.
std::optional<Vec2> ray_of(const Lens& lens, const Vec2& pixel);

/// The seed of a pair's alignment, a function of the run's seed and the two frames alone.
std::uint64_t pair_seed(std::uint64_t seed, int reference, int moving);

/// Chains correspondences into tracks. For each frame in ascending order: `starts` gives the
/// points to be followed from it (tracks that pass through it, then fresh points); `add` hands in
/// where they were found in a later frame. A track keeps the first position found in each frame:
/// that is the one followed from furthest back, so a chain takes the longest steps it can and its
/// error grows the least. Frames are numbered as the caller likes, so long as the numbers ascend.
class TrackChain {
 public:
  /// Points in this frame that no track holds within `spacing_px` begin new tracks.
  std::vector<Vec2> starts(int frame, const std::vector<Vec2>& fresh, double spacing_px);
  /// Where points of the latest starts() were found: `point_index` counts within what it returned.
  void add(int moving, const std::vector<int>& point_index, const std::vector<Vec2>& moving_px,
           double spacing_px);
  /// Tracks of at least two observations, whose `keyframe` is the frame's number.
  std::vector<Track> finish();

 private:
  std::vector<Track> tracks_;
  std::map<int, std::vector<int>> through_;  // of each frame: the tracks that pass through it
  std::vector<int> started_;                 // tracks of the last starts(), in its order
};

/// What following found.
struct Followed {
  std::vector<int> keyframes;  // frame indices: as selected, and those that had to come between
  std::vector<PairAlignment> pairs;  // of neighbouring key frames
  std::vector<Track> tracks;         // with rays
};

/// Aligns each key frame to the `neighbours` after it and chains the inliers into tracks. Where the
/// next one cannot be aligned, or fewer than half of the points are found in it, a frame between
/// them becomes a key frame: half way, a quarter, ... as near as it needs to be; where even the
/// very next frame cannot be aligned, the chain breaks; key frames after that look back at the
/// earlier ones most like them, to go on with their points. Fresh tracks start at corners (Shi and
/// Tomasi, CVPR 1994, doi:10.1109/CVPR.1994.323794) off the reflections, where the flow is best
/// determined.
Followed follow_tracks(const FrameSource& frames, const Keyframes& keyframes,
                       const AlignOptions& align_options, const TrackOptions& options,
                       std::uint64_t seed, Progress& progress);

}  // namespace rugae
