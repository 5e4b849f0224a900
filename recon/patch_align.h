#pragma once
// Fine registration, the paper's equation of e_MSE: Gauss-Newton on six affine parameters over
// circular patches.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/types.h"

namespace rugae {

using Affine2 = Eigen::Matrix<double, 2, 3>;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// One image pair at one resolution: intensities in [0, 1] (CV_32F) and the union of the circular
/// patches in each (CV_8U, non-zero inside).
struct PatchPair {
  cv::Mat reference, moving;
  cv::Mat reference_patches, moving_patches;
};

/// A mask of the given size: pixels with centres within `radius_px` of a point.
cv::Mat circular_patches(const std::vector<Vec2>& points_px, double radius_px,
                         const cv::Size& size);

/// The cost, its gradient and Gauss-Newton matrix at one affine:
///
///   e(A) = sum_i w(x_i) w(x_i') (I_ref(x_i') - I_mov(x_i))^2 / n,   x_i' = A x_i,
///   n = sum_i w(x_i) w(x_i')
///
/// over the pixels x_i of the moving image. The parameters are those of A in coordinates centred in
/// the image and divided by half its width, in the order a1 a2 tx a3 a4 ty. The gradient is that of
/// n e(A) at fixed overlap.
struct PatchCost {
  double squared_error = 0.0;
  double overlap_px = 0.0;
  Vec6 gradient = Vec6::Zero();
  Mat6 normal_matrix = Mat6::Zero();
  double mse() const { return squared_error / overlap_px; }
};
PatchCost patch_cost(const PatchPair& pair, const Affine2& ref_from_mov);

struct AffineFit {
  Affine2 ref_from_mov = Affine2::Identity();
  double mse = 0.0;
  int iterations = 0;  // over all resolutions
  bool converged = false;
};

struct AffineFitOptions {
  double stop_mse = 0.0;
  int max_iterations = 100;
};

/// Minimises e(A) from a start, coarse to fine over a pyramid; ends when the MSE at full resolution
/// is below `stop_mse`, when a step moves no image corner by 0.01 px or lowers the MSE by less than
/// 0.1 %, or when no part of the Gauss-Newton step lowers it (all `converged`), or after
/// `max_iterations`.
AffineFit fit_affine(const PatchPair& pair, const Affine2& start, const AffineFitOptions& options);

}  // namespace rugae
