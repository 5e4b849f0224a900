#pragma once
// The stages of the reconstruction that another implementation can take the place of: an oracle
// that knows the answer, to see how much of the error a stage is guilty of, or a method under test.
// What a replacement knows is its own affair: nothing here reads more than observations.

#include <functional>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "core/rigid3.h"
#include "recon/map.h"
#include "recon/options.h"
#include "recon/tracks.h"

namespace rugae {

struct Stages {
  /// Key frames, their pairs and tracks: follow_frames().
  std::function<Followed(const FrameSource&, const ReconOptions&, Progress&)> follow;
  /// Poses of the key frames, and points: build_structure().
  std::function<Structure(const FrameSource&, const std::vector<int>& keyframes, std::vector<Track>,
                          const ReconOptions&, Progress&)>
      structure;
  /// Poses of all frames, cam_from_world: resect_frames().
  std::function<std::vector<std::optional<Rigid3>>(const FrameSource&, const Structure&,
                                                   const ReconOptions&, Progress&)>
      resect;
  /// Depth of a mosaic: place_mosaic().
  std::function<std::optional<MosaicDepth>(const Mosaic&, const Structure&, const Lens&,
                                           const ReconOptions&)>
      depth;

  /// Ours, by the method that the options name.
  Stages();
};

}  // namespace rugae
