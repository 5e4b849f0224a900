#pragma once
// Reconstruction: observations in, estimate out. Never truth.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/progress.h"
#include "dataset/estimate.h"
#include "dataset/observations.h"
#include "recon/dense/dense_map.h"
#include "recon/listener.h"
#include "recon/map.h"
#include "recon/mosaic_map.h"
#include "recon/motion.h"
#include "recon/options.h"
#include "recon/stages.h"

namespace rugae {

/// Runs the method and writes the estimate's folder (depth and pictures as it goes). Throws Error
/// for fewer than two usable frames; frames that cannot be placed are `lost`, not errors.
Estimate reconstruct(const Observations& observations, const ReconOptions& options,
                     const std::filesystem::path& out, Progress& progress);

/// A map, and what it was made from: for pictures.
struct MadeMap {
  TriangleMesh mesh;  // in the structure's world
  std::map<std::string, double> numbers;
  std::vector<DepthExample> examples;  // of `dense`
  std::vector<MosaicExample> mosaics;  // of `paper`
};

/// `pairs` of neighbouring key frames; `motions` as in build_dense_map().
MadeMap make_map(const FrameSource& frames, const Structure& structure,
                 const std::vector<CameraMotion>& motions, const std::vector<PairAlignment>& pairs,
                 const ReconOptions& options, const Stages& stages, Progress& progress);

/// The second half alone, with a motion from estimate_motion(), perhaps of an earlier run: mosaics,
/// shape from shading, map, depth and pictures, which go to the listener as well. `frames` are
/// preprocessed as `options` say.
Estimate build_map(const FrameSource& frames, const Motion& motion, const ReconOptions& options,
                   const std::filesystem::path& out, const Stages& stages, Progress& progress,
                   Listener* listener = nullptr);

}  // namespace rugae
