#include "recon/dense/stereo_image.h"

#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "recon/masked_blur.h"

namespace rugae {
namespace {

/// Spread of the mean that brightness is compared with, in window radii: wide enough to leave the
/// window's texture, narrow enough to follow the light.
constexpr double kMeanRadii = 2.0;
/// Grey levels below this carry more noise than wall.
constexpr float kDarkest = 8.0f;

/// Brightness over its local mean, over known pixels only, minus one.
cv::Mat relative_brightness(const cv::Mat& gray, const cv::Mat& known, double sigma_px) {
  const cv::Mat mean = masked_blur(gray, known, sigma_px);
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  cv::Mat texture(gray.size(), CV_32F);
  for (int y = 0; y < gray.rows; ++y) {
    const auto *g = gray.ptr<float>(y), *m = mean.ptr<float>(y);
    auto* t = texture.ptr<float>(y);
    for (int x = 0; x < gray.cols; ++x) t[x] = m[x] > kDarkest ? g[x] / m[x] - 1.0f : kUnknown;
  }
  return texture;
}

/// Half as many pixels each way, an odd last row or column repeated; a mask holds where all of a
/// pixel's four do.
cv::Mat halved_picture(const cv::Mat& picture, const PinholeGrid& half, bool mask) {
  cv::Mat even, small;
  cv::copyMakeBorder(picture, even, 0, 2 * half.height - picture.rows, 0,
                     2 * half.width - picture.cols, cv::BORDER_REPLICATE);
  cv::resize(even, small, half.size(), 0.0, 0.0, cv::INTER_AREA);
  return mask ? cv::Mat(small == 255) : small;
}

}  // namespace

std::vector<StereoImage> stereo_levels(const WideFrame& frame, const PinholeGrid& grid, int levels,
                                       int radius_px) {
  check(frame.bgr.type() == CV_32FC3 && frame.known.type() == CV_8U &&
            frame.bgr.size() == grid.size() && frame.known.size() == grid.size(),
        "stereo_levels: expected a CV_32FC3 picture and a CV_8U mask of the grid's size");
  cv::Mat gray, known = frame.known;
  cv::cvtColor(frame.bgr, gray, cv::COLOR_BGR2GRAY);
  std::vector<StereoImage> images;
  PinholeGrid level_grid = grid;
  for (int level = 0; level < levels; ++level) {
    if (level > 0) {
      level_grid = halved(level_grid);
      gray = halved_picture(gray, level_grid, false);
      known = halved_picture(known, level_grid, true);
    }
    images.push_back({level_grid, relative_brightness(gray, known, kMeanRadii * radius_px)});
  }
  return images;
}

}  // namespace rugae
