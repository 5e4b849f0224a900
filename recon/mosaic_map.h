#pragma once
// The paper's map from frames whose poses are known: algorithm 3, steps 8 to 10, the depth of each
// mosaic by shading, one surface.

#include <optional>
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "recon/align.h"
#include "recon/map.h"
#include "recon/mosaic.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/stages.h"
#include "recon/structure.h"

namespace rugae {

/// A mosaic on its way, for people.
struct MosaicExample {
  int number = -1;  // among all mosaics
  Mosaic mosaic;
  std::optional<MosaicDepth> depth;  // none where too few points fix it
};

struct MosaicMap {
  TriangleMesh mesh;  // in the structure's world, map units
  std::vector<MosaicExample> examples;
};

/// `pairs` of neighbouring key frames; `examples`: how many are to be returned. Memory holds seven
/// bytes for each pixel of a placed mosaic, and a few mosaics whole. Empty where nothing was
/// placed; the same for any number of threads.
MosaicMap build_mosaic_map(const FrameSource& frames, const Structure& structure,
                           const std::vector<PairAlignment>& pairs, const ReconOptions& options,
                           const Stages& stages, int examples, Progress& progress);

}  // namespace rugae
