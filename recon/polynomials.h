#pragma once
// Quadratic polynomials around each pixel (Farneback, SCIA 2003, doi:10.1007/3-540-45103-X_50).

#include <opencv2/core/mat.hpp>
#include <vector>

namespace rugae {

/// Around each pixel of a pyramid level f(x) ~ x^T A x + b^T x + c; c is not kept.
struct PolynomialLevel {
  cv::Mat terms;  // CV_32FC4: b_y, b_x, A_yy, A_xx
  cv::Mat mixed;  // CV_32F: 2 A_xy
};

/// From the full image on, each level half as large.
using PolynomialPyramid = std::vector<PolynomialLevel>;

/// The polynomials of `image` (CV_8U, at least 4 x 4).
PolynomialPyramid expand_polynomials(const cv::Mat& image);

}  // namespace rugae
