#pragma once
// Optical flow under a light that moves with the camera.

#include <opencv2/core/mat.hpp>

#include "recon/farneback.h"

namespace rugae {

/// `gray` (CV_8U) with the light taken out: local mean removed, divided by the local standard
/// deviation. The light and its fall-off stand still in the image while the wall moves; unless they
/// are taken out, flow follows them and comes out too short. Where `valid` (CV_8U; empty:
/// everywhere) is 0 the result is the middle, and the pixels around do not see what is there: the
/// edge of a field stop stands still too.
cv::Mat even_light(const cv::Mat& gray, const cv::Mat& valid = {});

/// What the flow needs of an image, computed once and shared by all pairs the image takes part in.
struct FlowImage {
  cv::Mat coarse;                 // CV_8U, even light at a few px a fold
  PolynomialPyramid polynomials;  // of the image with even light
};

/// `gray` and `valid` as for even_light.
FlowImage prepare_flow(const cv::Mat& gray, const cv::Mat& valid = {});

/// A first guess of the flow (CV_32FC2, px, the images' size): blocks of an eighth of the width
/// compared by normalised correlation over a quarter of the width in every direction, the scores
/// of neighbouring blocks supporting each other. It reaches motions that are lost in the top of a
/// pyramid, where one pixel is wider than a fold.
cv::Mat coarse_flow(const FlowImage& reference, const FlowImage& moving);

/// Farneback's flow (CV_32FC2, px) from `reference` to `moving`, two images of one size, on the
/// images with even light, started at `initial` or, where that is empty, at the coarse flow.
cv::Mat farneback_flow(const FlowImage& reference, const FlowImage& moving,
                       const cv::Mat& initial = {});

/// The same of one pair alone (CV_8U); `valid` holds for both images.
cv::Mat farneback_flow(const cv::Mat& reference, const cv::Mat& moving, const cv::Mat& initial = {},
                       const cv::Mat& valid = {});

}  // namespace rugae
