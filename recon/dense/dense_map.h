#pragma once
// The wall from frames whose poses are known: depth maps of some key frames by stereo, what agrees
// of them, the wall between, one surface.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "recon/rolling_shutter.h"
#include "recon/structure.h"

namespace rugae {

/// A depth map on its way, for people.
struct DepthExample {
  int frame = -1;
  cv::Mat picture;        // CV_8UC3, BGR: the key frame on the depth map's grid
  cv::Mat found, agreed;  // CV_32F: by stereo; what other depth maps agree with, gaps filled
  cv::Mat sigma;          // CV_32F, of `agreed`
};

struct DenseMap {
  /// World of the structure, map units; geometric normals point away from the cameras; colours are
  /// the wall's own (albedo up to one gain); each vertex has its sigma.
  TriangleMesh mesh;
  int depth_maps = 0;
  double depth_share = 0.0;   // of their pixels have a depth that others agree with
  double median_sigma = 0.0;  // of these depths, over the depth
  std::vector<DepthExample> examples;
};

/// Depth maps of chosen key frames, their consistency, their gaps, fusion. `reflections`: how they
/// are detected, to be left out; `examples`: how many are to be returned. Memory holds at most
/// `max_depth_maps` small depth maps, a few frames and the surface. `motions`: of the key frames
/// while their rows were read, where the structure's poses know of that; empty: poses of all rows
/// at once. Empty where nothing was placed or seen from enough places; the same for any number of
/// threads.
DenseMap build_dense_map(const FrameSource& frames, const Structure& structure,
                         const std::vector<CameraMotion>& motions,
                         const ReflectionOptions& reflections, const DenseOptions& options,
                         int examples, Progress& progress);

}  // namespace rugae
