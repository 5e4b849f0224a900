#pragma once
// Means of what is known.

#include <opencv2/core/mat.hpp>

namespace rugae {

/// CV_32F: the mean around each pixel under a Gaussian of `sigma_px`, over known pixels only,
/// blur(value * known) / blur(known). `values`: CV_32F; `known`: CV_8U, 255 or 0. 0 where unknown.
cv::Mat masked_blur(const cv::Mat& values, const cv::Mat& known, double sigma_px);

}  // namespace rugae
