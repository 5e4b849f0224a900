#include "recon/small_blur.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace rugae {

cv::Mat small_blur(const cv::Mat& picture, double sigma_px, int border) {
  constexpr double kSigma = 3.0;  // of the small picture, at least: its pixels show in no sum
  const int shrink = std::max(1, static_cast<int>(sigma_px / kSigma));
  cv::Mat small, blurred;
  if (shrink == 1) {
    cv::GaussianBlur(picture, blurred, {}, sigma_px, sigma_px, border);
    return blurred;
  }
  cv::resize(picture, small,
             {(picture.cols + shrink - 1) / shrink, (picture.rows + shrink - 1) / shrink}, 0, 0,
             cv::INTER_AREA);
  // Shrinking and enlarging blur too: by a box of n pixels, of variance (n^2 - 1) / 12, and a tent
  // of twice n, n^2 / 6.
  const double n2 = shrink * shrink;
  const double sigma = std::sqrt((sigma_px * sigma_px - (n2 - 1.0) / 12.0 - n2 / 6.0) / n2);
  cv::GaussianBlur(small, blurred, {}, sigma, sigma, border);
  return blurred;
}

}  // namespace rugae
