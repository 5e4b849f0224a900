#pragma once
// Correspondences between pairs of frames, chained into tracks.

#include <map>
#include <vector>

#include "recon/structure.h"

namespace rugae {

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
  /// All tracks so far; `keyframe` of an observation is the frame's number.
  const std::vector<Track>& tracks() const { return tracks_; }
  /// Which of them pass through a frame.
  const std::vector<int>& through(int frame) const;
  /// Tracks of at least two observations.
  std::vector<Track> finish();

 private:
  std::vector<Track> tracks_;
  std::map<int, std::vector<int>> through_;  // of each frame: the tracks that pass through it
  std::vector<int> started_;                 // tracks of the last starts(), in its order
};

}  // namespace rugae
