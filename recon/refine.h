#pragma once
// Correspondences to a fraction of a pixel: each point's own small patch, matched up to gain and
// offset.

#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/types.h"

namespace rugae {

struct PointRefinementOptions {
  double radius_px = 7.0;
  int max_iterations = 12;
  double max_motion_px = 4.0;      // further from the start: another minimum
  double min_correlation = 0.7;    // normalised cross-correlation of the patches at the end
  double max_deviation_px = 0.25;  // predicted standard deviation of the worse direction
};

/// Gauss-Newton on the place in `moving` of the patch around `reference_px`, start `moving_px`;
/// `linear` is the patch's linear map, mov from ref, kept. The squared difference is normalised:
/// mean and gain of each patch are removed (the light moves with the camera), as in Lucas and
/// Kanade with affine illumination (Baker and Matthews, IJCV 2004, doi:10.1023/B:VISI.0000011205.
/// 11775.fd, inverse compositional). Images are CV_32F. Empty when the patch leaves an image, does
/// not converge, matches badly, or its texture does not fix the place.
std::optional<Vec2> refine_point(const cv::Mat& reference, const cv::Mat& moving,
                                 const Vec2& reference_px, const Vec2& moving_px,
                                 const Mat2& linear, const PointRefinementOptions& options);

}  // namespace rugae
