#pragma once
// Where the camera is while frames still come: a structure that grows with the tracks, without the
// revisits and the joint adjustment at the end.

#include <optional>

#include "recon/growth.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/resection.h"
#include "recon/tracks.h"

namespace rugae {

class LivePath {
 public:
  LivePath(const FrameSource& frames, const ReconOptions& options);

  /// Takes over what was followed since, and places the key frames that can be placed.
  void update(const TrackFollower& follower);
  /// In a world and unit of its own, which stay as they are: those of the pair it began with.
  const Structure& structure() const { return structure_; }
  /// cam_from_world; empty before the path has begun, and where the frame sees too little of what
  /// is known.
  std::optional<Rigid3> place(int frame) const;

 private:
  void take(const TrackChain& chain, int keyframe);

  const FrameSource& frames_;
  Structure structure_;
  SegmentGrowth growth_;
  Resector resector_;
  std::vector<std::size_t>
      taken_;  // of each key frame: how many of its tracks are in the structure
  bool begun_ = false;
};

}  // namespace rugae
