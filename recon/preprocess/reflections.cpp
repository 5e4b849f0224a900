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
// Inpainting looks at what lies within its radius, and at the differences there.
constexpr int kBeyondRadiusPx = 3;

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

// Piece by piece, where pieces are too far apart to see each other: the front that OpenCV moves
// over all of them at once is a sorted list, and what a pixel costs grows with its length.
cv::Mat suppress_reflections(const cv::Mat& image, const cv::Mat& reflection,
                             const ReflectionOptions& options) {
  const int method = options.inpainting == Inpainting::telea ? cv::INPAINT_TELEA : cv::INPAINT_NS;
  cv::Mat around, labels, boxes, centres;
  const int reach_px = static_cast<int>(std::ceil(options.inpaint_radius_px)) + kBeyondRadiusPx;
  const int side = 2 * reach_px + 1;
  cv::dilate(reflection, around, cv::Mat::ones(side, side, CV_8U));
  const int pieces = cv::connectedComponentsWithStats(around, labels, boxes, centres);
  cv::Mat painted = image.clone();
  for (int piece = 1; piece < pieces; ++piece) {  // 0 is where there is nothing to paint
    const cv::Rect box(
        boxes.at<int>(piece, cv::CC_STAT_LEFT), boxes.at<int>(piece, cv::CC_STAT_TOP),
        boxes.at<int>(piece, cv::CC_STAT_WIDTH), boxes.at<int>(piece, cv::CC_STAT_HEIGHT));
    const cv::Mat mask = (labels(box) == piece) & reflection(box);
    cv::Mat part;
    cv::inpaint(image(box), mask, part, options.inpaint_radius_px, method);
    part.copyTo(painted(box), mask);
  }
  return painted;
}

}  // namespace rugae
