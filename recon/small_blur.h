#pragma once
// Wide blurs for little time.

#include <opencv2/core/mat.hpp>

namespace rugae {

/// `picture` under a Gaussian of `sigma_px`, as small as holds it: divided by a whole number once
/// sigma is many pixels wide. Enlarged to the picture's size by cv::resize with INTER_LINEAR it is
/// cv::GaussianBlur of the picture, within a fiftieth of the picture's contrast. `border` is
/// that of cv::GaussianBlur; one that makes the blur fall steeply, as BORDER_CONSTANT, is flat over
/// the last half pixel of the small picture, which a quotient of two such blurs does not show.
cv::Mat small_blur(const cv::Mat& picture, double sigma_px, int border);

}  // namespace rugae
