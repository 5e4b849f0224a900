#pragma once
// From frames to tracks as the frames come: algorithm 2 and algorithm 3's steps 2 to 6, side by
// side.

#include <memory>
#include <vector>

#include "core/progress.h"
#include "recon/keyframes.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/tracks.h"

namespace rugae {

/// How key frames are aligned, by the method.
AlignOptions follow_options(const ReconOptions& options);

/// Frames that are best looked at together, where so many are there.
inline constexpr int kFramesAtOnce = 8;

/// Chooses key frames and follows points from one to the next. Which are chosen does not depend on
/// what is followed, so both are done at the same time: frames are looked at while the key frames
/// found before them are followed. What is found does not depend on how many frames come at a time.
class FrameFollower {
 public:
  /// `ahead` as in TrackFollower.
  FrameFollower(const FrameSource& frames, const ReconOptions& options, bool ahead);

  /// Looks at the frames up to before `end`, and follows the key frames known before the call.
  void look_at(int end);
  int looked_at() const { return looked_at_; }
  /// Follows the key frames known by now.
  void catch_up();
  /// Follows to the end: nothing comes after it.
  Followed finish();

  const TrackFollower& tracks() const { return follower_; }
  /// Choosing and following. Time that both took together is divided by how long each took of it,
  /// so that the sum is what passed.
  std::vector<StageTime> stages() const { return {selecting_, following_}; }

 private:
  KeyframeSelector selector_;
  TrackFollower follower_;
  std::size_t followed_ = 0;  // key frames handed to the follower
  int looked_at_ = 0;         // frames
  StageTime selecting_{"key frames"}, following_{"pairwise alignment"};
};

/// All of a sequence, with a progress line.
Followed follow_frames(const FrameSource& frames, const ReconOptions& options, Progress& progress);

}  // namespace rugae
