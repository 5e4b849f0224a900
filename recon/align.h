#pragma once
// Pairwise alignment, the paper's algorithm 3, steps 2 to 6: Farneback matches, RANSAC homography,
// then Gauss-Newton on the affine parameters over circular patches at the inliers.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "core/types.h"
#include "recon/flow.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

struct PairAlignment {
  int reference = -1, moving = -1;  // frame indices
  /// Inlier correspondences, (0.5, 0.5) convention, preprocessed frames: each the flow's match
  /// refined on its own patch, not the homography's prediction.
  std::vector<Vec2> reference_px, moving_px;
  std::vector<int> point_index;  // of each correspondence: its place in
                                 // AlignGuess::reference_points; empty when a grid was followed
  Mat3 ref_from_mov_homography = Mat3::Identity();
  Eigen::Matrix<double, 2, 3> ref_from_mov_affine =
      Eigen::Matrix<double, 2, 3>::Identity();  // refined
  double mse = 0.0;    // mean squared intensity error over the patches, intensities in [0, 1]
  int matches = 0;     // of the flow, forward-backward consistent
  int inliers = 0;     // of all homographies; those that could be refined are the correspondences
  int iterations = 0;  // of Gauss-Newton
  bool converged = false;

  /// There are thousands of them, and the tracks hold what is needed of them.
  void forget_correspondences() { reference_px = moving_px = {}, point_index = {}; }
};

/// What alignment needs of a frame, computed once and shared by all pairs the frame takes part in.
struct AlignImage {
  int index = -1;             // of the frame
  cv::Mat gray;               // CV_8U
  cv::Mat intensity, smooth;  // CV_32F, [0, 1]; smoothed: where noise hides the texture
  cv::Mat usable, landing;    // CV_8U: where a point may start, and where it may be found
  FlowImage flow;             // shrunk
};

/// What is the same for all frames of a sequence, computed once; `valid` is Frame::valid.
struct AlignField {
  cv::Mat landing;     // CV_8U
  cv::Mat flow_valid;  // CV_8U, shrunk
};

AlignField prepare_field(const cv::Mat& valid, const AlignOptions& options);

AlignImage prepare_alignment(const Frame& frame, const AlignField& field);

/// The flow of a pair, there and back, at the size of AlignImage::flow.
struct PairFlow {
  cv::Mat forward, backward;  // CV_32FC2, px of the shrunk images; empty: not measured
};

/// `guess` is as AlignGuess::flow.
PairFlow measure_flow(const AlignImage& reference, const AlignImage& moving,
                      const cv::Mat& guess = {});

/// What the caller knows of a pair beforehand.
struct AlignGuess {
  /// Follow these points of the reference (they need not be integer pixels) instead of a grid, so
  /// that tracks chain over many key frames. Points outside the image are never inliers.
  std::vector<Vec2> reference_points;
  cv::Mat flow;  // CV_32FC2, px, a first guess of the flow from reference to moving; may be empty
  bool affine = true;  // false: correspondences alone are wanted, no affine is fitted; as false
                       // in AlignOptions
  PairFlow measured;   // the flow itself, where the caller has measured it already
};

/// Empty when the pair cannot be aligned (too few inliers). Correspondences are forward-backward
/// consistent flow at the grid or the given points, never on a reflection or an invalid pixel. One
/// plane cannot hold a cavity: after the first homography (the one reported) further homographies
/// are taken from what the earlier ones left, while they find at least `min_inliers`; the inliers
/// of all of them are returned.
std::optional<PairAlignment> align(const AlignImage& reference, const AlignImage& moving,
                                   const AlignOptions& options, std::uint64_t seed,
                                   const AlignGuess& guess = {});

/// Of one pair alone.
std::optional<PairAlignment> align(const Frame& reference, const Frame& moving,
                                   const AlignOptions& options, std::uint64_t seed,
                                   const AlignGuess& guess = {});

}  // namespace rugae
