#pragma once
// The depth of one key frame.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/rigid3.h"
#include "recon/dense/stereo_image.h"
#include "recon/options.h"
#include "recon/structure.h"

namespace rugae {

/// z-depth on a small pinhole grid, map units; NaN where unknown.
struct DepthMap {
  PinholeGrid grid;
  Rigid3 cam_from_world;
  cv::Mat depth;  // CV_32F
  cv::Mat sigma;  // CV_32F: standard deviation of the depth, map units
};

/// A frame as stereo sees it.
struct StereoView {
  Rigid3 cam_from_world;
  std::vector<StereoImage> levels;  // the finest first
};

/// Levels of a StereoView.
constexpr int kStereoLevels = 2;

/// A place of the wall that tracks give.
struct SparseDepth {
  Vec2 pixel;  // of the grid
  double z = 0.0;
};

/// The points of the structure that the key frame sees.
std::vector<SparseDepth> sparse_depths(const Structure& structure, int keyframe,
                                       const PinholeGrid& grid);

/// Where the search for depth begins.
struct DepthPrior {
  cv::Mat depth;          // CV_32F, on the grid of the coarsest level; positive everywhere
  double reach_ln = 0.0;  // the wall is within this of ln depth
};

/// A smooth surface through the points that the key frame sees, and how far from it the wall may
/// be: what the points themselves stray from it. `reach_ln` is 0 and depth empty where too few
/// points fix it.
DepthPrior depth_prior(const Structure& structure, int keyframe, const PinholeGrid& grid);

/// Depth of the reference by comparing it with the sources: surfaces of the prior's shape, nearer
/// and farther, are swept through the finest level's half, and again, close to what was found
/// there, through the finest. Of the correlations the mean over the better half of the sources
/// counts, since the others may not see the place. Unknown stays what does not correlate, or only
/// within a wide range of depths.
DepthMap estimate_depth(const StereoView& reference, const std::vector<const StereoView*>& sources,
                        const DepthPrior& prior, const DenseOptions& options);

/// Looks again where the map has no depth yet, with the wall known about: the coarsest level,
/// windows half as wide again, which lie on `surface` (CV_32F, z-depth on the map's grid, known
/// everywhere), and a correlation that would be chance in a search farther from it. CV_8U: 255
/// where it found one.
cv::Mat look_again(const StereoView& reference, const std::vector<const StereoView*>& sources,
                   const cv::Mat& surface, const DenseOptions& options, DepthMap& map);

}  // namespace rugae
