#pragma once
// The same wall seen again: each point's patch is looked for in every key frame that geometry says
// sees it, also hundreds of frames later. What neighbours alone tie together drifts; a revisit
// takes the drift out.

#include "core/progress.h"
#include "recon/dense/wall_patch.h"
#include "recon/options.h"

namespace rugae {

/// Of one pass over the key frames.
struct RevisitReport {
  std::size_t patches = 0;
  std::size_t foretold = 0;    // sights that geometry promises and no track holds
  std::size_t found = 0;       // of those: patches that look alike there
  std::size_t accepted = 0;    // of those: agree on where the key frame stands
  std::size_t registered = 0;  // observations of tracks placed anew by their anchor's patch
};

/// Every observation is registered to its track's anchor, so that a track does not drift along its
/// key frames; and the patches that a key frame should see and no track holds there are looked for
/// around where they should be. Found ones are grouped by when their anchors saw them; a group
/// counts where its points agree on one pose of the key frame (place_by_points), which may differ
/// from the pose it has by what the path has drifted. The observations are added to the tracks,
/// nothing is adjusted.
RevisitReport observe_again(const FrameSource& frames, const std::vector<WallPatch>& patches,
                            const RevisitOptions& options, const BundleOptions& bundle,
                            Structure& structure, Progress& progress);

/// Rounds of making patches, observing again and adjusting all.
void link_revisits(const FrameSource& frames, const RevisitOptions& options,
                   const BundleOptions& bundle, Structure& structure, Progress& progress);

}  // namespace rugae
