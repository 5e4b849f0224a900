#include "recon/preprocess/reflections.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>

#include "core/check.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;

// 255 where the value is at least mean + standard deviation, both of the field's; nothing on a
// constant image, whose every pixel would pass.
cv::Mat above_mean_plus_deviation(const cv::Mat& image, const cv::Mat& field) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation, field);
  if (!(deviation[0] > 0.0)) return cv::Mat::zeros(image.size(), CV_8U);
  cv::Mat mask;
  cv::compare(image, mean[0] + deviation[0], mask, cv::CMP_GE);
  return mask;
}

cv::Mat gradient_magnitude(const cv::Mat& gray) {
  cv::Mat gx, gy, magnitude;
  cv::Sobel(gray, gx, CV_32F, 1, 0, 3, 1.0 / 8.0);
  cv::Sobel(gray, gy, CV_32F, 0, 1, 3, 1.0 / 8.0);
  cv::magnitude(gx, gy, magnitude);
  return magnitude;
}

}  // namespace

cv::Mat detect_reflections(const cv::Mat& gray, const ReflectionOptions& options,
                           const cv::Mat& field) {
  check(gray.type() == CV_8U && !gray.empty(),
        "reflection detection: expected an 8-bit gray image, found type {}, {} x {}", gray.type(),
        gray.cols, gray.rows);
  const int side = std::max(
      3, static_cast<int>(std::lround(options.closing_px * gray.cols / kReferenceWidthPx)));
  const cv::Mat element = cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side});
  cv::Mat gradient = gradient_magnitude(gray), closed;
  if (!field.empty()) {
    cv::Mat inner;  // where the gradient has no part of the stop's edge
    cv::erode(field, inner, cv::Mat::ones(5, 5, CV_8U));
    gradient.setTo(0.0, inner == 0);
  }
  cv::morphologyEx(gradient, closed, cv::MORPH_CLOSE, element);
  const cv::Mat found =
      above_mean_plus_deviation(closed, field) & above_mean_plus_deviation(gray, field);
  return field.empty() ? found : cv::Mat(found & field);
}

cv::Mat suppress_reflections(const cv::Mat& image, const cv::Mat& reflection,
                             const ReflectionOptions& options) {
  if (cv::countNonZero(reflection) == 0) return image.clone();
  const int method = options.inpainting == Inpainting::telea ? cv::INPAINT_TELEA : cv::INPAINT_NS;
  cv::Mat painted;
  cv::inpaint(image, reflection, painted, options.inpaint_radius_px, method);
  return painted;
}

}  // namespace rugae
