#pragma once
// The first half of the reconstruction: how the camera moved, and the sparse points it saw.

#include <filesystem>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "recon/options.h"
#include "recon/stages.h"
#include "recon/structure.h"

namespace rugae {

/// All that the second half, the map, is made from beside the frames.
struct Motion {
  Structure structure;
  /// Of neighbouring key frames, with their homographies. Correspondences are kept of a few alone,
  /// spread over the sequence, for pictures.
  std::vector<PairAlignment> pairs;
  std::vector<std::optional<Rigid3>> cam_from_world;  // of all frames; empty: lost
  std::vector<StageTime> stages;                      // what finding it took
};

/// Algorithms 2 and 3 up to step 7: key frames, pairs, all poses jointly, the frames between.
/// A stage that the caller has begun, such as preprocessing, counts as the first of
/// `Motion::stages`. Throws Error for fewer than two usable frames.
Motion estimate_motion(const FrameSource& frames, const ReconOptions& options, const Stages& stages,
                       Progress& progress);

/// The same from tracks that were followed already.
Motion solve_motion(const FrameSource& frames, Followed followed, const ReconOptions& options,
                    const Stages& stages, Progress& progress);

/// The options with all that estimate_motion does not look at set to defaults: where two of these
/// are the same, so is the motion.
ReconOptions motion_options(ReconOptions options);

/// One file, CBOR (RFC 8949), every number exactly; written whole or not at all.
void write_motion(const std::filesystem::path& file, const Motion& motion);
/// Throws Error naming the file when it is not one of these.
Motion read_motion(const std::filesystem::path& file);

}  // namespace rugae
