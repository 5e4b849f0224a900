#pragma once
// The wall from frames whose poses are known: depth maps of some key frames by stereo, what agrees
// of them, one surface.

#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/structure.h"

namespace rugae {

struct DenseMap {
  /// World of the structure, map units; geometric normals point away from the cameras; colours are
  /// the wall's own (albedo up to one gain); each vertex has its sigma.
  TriangleMesh mesh;
  int depth_maps = 0;
  double depth_share = 0.0;   // of their pixels have a depth that others agree with
  double median_sigma = 0.0;  // of these depths, over the depth
};

/// Depth maps of chosen key frames, their consistency, fusion. `reflections`: how they are
/// detected, to be left out. Memory holds at most `max_depth_maps` small depth maps, a few frames
/// and the surface. Empty where nothing was placed or seen from enough places; the same for any
/// number of threads.
DenseMap build_dense_map(const FrameSource& frames, const Structure& structure,
                         const ReflectionOptions& reflections, const DenseOptions& options,
                         Progress& progress);

}  // namespace rugae
