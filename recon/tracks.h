#pragma once
// Tracks: points of the wall followed from key frame to key frame by pairwise alignment.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "recon/align.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"
#include "recon/track_chain.h"

namespace rugae {

/// Ray (x/z, y/z) of a pixel; empty where the lens has none in front of the camera.
std::optional<Vec2> ray_of(const LensProjector& lens, const Vec2& pixel);

/// The seed of a pair's alignment, a function of the run's seed and the two frames alone.
std::uint64_t pair_seed(std::uint64_t seed, int reference, int moving);

/// What following found.
struct Followed {
  std::vector<int> keyframes;  // frame indices: as selected, and those that had to come between
  /// Of neighbouring key frames. A dozen or two of them, spread evenly, have their correspondences,
  /// for pictures: memory does not grow with the path by what all have.
  std::vector<PairAlignment> pairs;
  std::vector<Track> tracks;      // with rays
  std::vector<StageTime> stages;  // what it took
};

/// Key frames one after another. Each is aligned to the `neighbours` after it, and the inliers are
/// chained into tracks. Where the next one cannot be aligned, or fewer than half of the points are
/// found in it, a frame between them becomes a key frame: half way, a quarter, ... as near as it
/// needs to be; where even the very next frame cannot be aligned, the chain breaks; key frames
/// after that look back at the earlier ones most like them, to go on with their points. Fresh
/// tracks start at corners (Shi and Tomasi, CVPR 1994, doi:10.1109/CVPR.1994.323794) off the
/// reflections, where the flow is best determined.
class TrackFollower {
 public:
  /// With `ahead` the next key frame but one is prepared while the next is followed to: faster,
  /// and the same, but that the tracks are known one key frame later.
  TrackFollower(const FrameSource& frames, const AlignOptions& align_options,
                const TrackOptions& options, std::uint64_t seed, bool ahead = true);
  ~TrackFollower();

  /// The next key frame; follows from those that all they are aligned to is known of.
  void add(int frame);
  /// Follows from the rest: nothing is to be added after it.
  Followed finish();
  /// Key frames that no other will come between any more.
  std::vector<int> settled() const;
  /// What was followed so far; observations are numbered by the frame's index.
  const TrackChain& chain() const;
  const std::vector<PairAlignment>& pairs() const;
  /// For people: what failed, what came between.
  std::string remark() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rugae
