#pragma once
// Pairwise alignment, the paper's algorithm 3, steps 2 to 6: Farneback matches, RANSAC homography,
// then Gauss-Newton on the affine parameters over circular patches at the inliers.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "core/types.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

struct PairAlignment {
  int reference = -1, moving = -1;  // frame indices
  std::vector<Vec2> reference_px,
      moving_px;  // inlier correspondences, (0.5, 0.5) convention, preprocessed frames
  Mat3 ref_from_mov_homography = Mat3::Identity();
  Eigen::Matrix<double, 2, 3> ref_from_mov_affine =
      Eigen::Matrix<double, 2, 3>::Identity();  // refined
  double mse = 0.0;  // mean squared intensity error over the patches, intensities in [0, 1]
  int inliers = 0, iterations = 0;
  bool converged = false;
};

/// Empty when the pair cannot be aligned (too few inliers).
std::optional<PairAlignment> align(const Frame& reference, const Frame& moving,
                                   const AlignOptions& options, std::uint64_t seed);

}  // namespace rugae
