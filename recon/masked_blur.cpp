#include "recon/masked_blur.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace rugae {

cv::Mat masked_blur(const cv::Mat& values, const cv::Mat& known, double sigma_px) {
  cv::Mat share, sum, weight;
  known.convertTo(share, CV_32F, 1.0 / 255.0);
  cv::GaussianBlur(values.mul(share), sum, {}, sigma_px, sigma_px, cv::BORDER_CONSTANT);
  cv::GaussianBlur(share, weight, {}, sigma_px, sigma_px, cv::BORDER_CONSTANT);
  cv::Mat mean = sum / cv::max(weight, 1e-6);
  mean.setTo(0.0f, known == 0);
  return mean;
}

}  // namespace rugae
