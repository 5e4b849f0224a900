#include "recon/dense/linked_structure.h"

#include <utility>

#include "recon/dense/moving_keyframes.h"
#include "recon/dense/rejoin.h"
#include "recon/dense/revisits.h"

namespace rugae {

Structure build_linked_structure(const FrameSource& frames, const std::vector<int>& keyframes,
                                 std::vector<Track> tracks, const RevisitOptions& options,
                                 const BundleOptions& bundle, Progress& progress) {
  std::vector<Structure> segments =
      build_segments(keyframes, std::move(tracks), frames.lens(), bundle, progress);
  Structure found = std::move(segments.front());
  segments.erase(segments.begin());
  if (found.placed_count() == 0) return found;
  const bool linked = options.rounds > 0, rolling = frames.shutter().rolling();
  finish_structure(found, frames.lens(), bundle,
                   linked || rolling ? kDraftAdjustment : kFinalAdjustment, progress);
  if (!linked) {
    if (rolling) finish_moving(frames, bundle, kFinalAdjustment, found, progress);
    return found;
  }
  link_revisits(frames, options, bundle, found, progress);
  if (!segments.empty() &&
      rejoin(frames, std::move(segments), options, bundle, found, progress) > 0)
    link_revisits(frames, options, bundle, found, progress);
  return found;
}

}  // namespace rugae
