#include "recon/masked_blur.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/small_blur.h"

namespace rugae {

cv::Mat masked_blur(const cv::Mat& values, const cv::Mat& known, double sigma_px) {
  cv::Mat share, mean;
  known.convertTo(share, CV_32F, 1.0 / 255.0);
  const cv::Mat sum = small_blur(values.mul(share), sigma_px, cv::BORDER_CONSTANT);
  const cv::Mat weight = small_blur(share, sigma_px, cv::BORDER_CONSTANT);
  cv::resize(sum / cv::max(weight, 1e-6), mean, values.size(), 0, 0, cv::INTER_LINEAR);
  mean.setTo(0.0f, known == 0);
  return mean;
}

}  // namespace rugae
