#pragma once
// Farneback's optical flow (SCIA 2003, doi:10.1007/3-540-45103-X_50) of a pair of images, from the
// polynomials that all pairs an image takes part in share.

#include <opencv2/core/mat.hpp>

#include "recon/polynomials.h"

namespace rugae {

/// The flow (CV_32FC2, px) from `reference` to `moving`, two pyramids of one shape, started at
/// `initial` (CV_32FC2 of the full size). What OpenCV's calcOpticalFlowFarneback computes, up to
/// rounding, with two halvings, three iterations a level and a window of 21 px.
cv::Mat farneback(const PolynomialPyramid& reference, const PolynomialPyramid& moving,
                  const cv::Mat& initial);

}  // namespace rugae
