#pragma once
// Optical flow under a light that moves with the camera.

#include <opencv2/core/mat.hpp>

namespace rugae {

/// `gray` (CV_8U) with the light taken out: local mean removed, divided by the local standard
/// deviation. The light and its fall-off stand still in the image while the wall moves; unless they
/// are taken out, flow follows them and comes out too short. Where `valid` (CV_8U; empty:
/// everywhere) is 0 the result is the middle, and the pixels around do not see what is there: the
/// edge of a field stop stands still too.
cv::Mat even_light(const cv::Mat& gray, const cv::Mat& valid = {});

/// A first guess of the flow (CV_32FC2, px, the images' size) between two images of even light:
/// blocks of an eighth of the width compared by normalised correlation over a quarter of the width
/// in every direction, the scores of neighbouring blocks supporting each other. It reaches motions
/// that are lost in the top of a pyramid, where one pixel is wider than a fold. `valid` holds for
/// both images.
cv::Mat coarse_flow(const cv::Mat& reference, const cv::Mat& moving, const cv::Mat& valid = {});

/// Farneback's flow (SCIA 2003, doi:10.1007/3-540-45103-X_50; CV_32FC2, px) from `reference` to
/// `moving` (CV_8U, one size), on the images with even light, started at `initial` or, where that
/// is empty, at the coarse flow. `valid` holds for both images. The same for any number of threads.
cv::Mat farneback_flow(const cv::Mat& reference, const cv::Mat& moving, const cv::Mat& initial = {},
                       const cv::Mat& valid = {});

}  // namespace rugae
