#include "recon/dense/stereo_image.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "recon/pinhole.h"

namespace rugae {
namespace {

/// Spread of the mean that brightness is compared with, in window radii: wide enough to leave the
/// window's texture, narrow enough to follow the light.
constexpr double kMeanRadii = 2.0;
/// Grey levels below this carry more noise than wall.
constexpr float kDarkest = 8.0f;
constexpr double kWhole = 254.5;  // of a mask averaged over a pixel's area

/// Brightness over its local mean, over known pixels only, minus one.
cv::Mat relative_brightness(const cv::Mat& gray, const cv::Mat& known, double sigma_px) {
  cv::Mat weight, sum, total;
  known.convertTo(weight, CV_32F, 1.0 / 255.0);
  cv::GaussianBlur(gray.mul(weight), sum, {}, sigma_px, sigma_px, cv::BORDER_CONSTANT);
  cv::GaussianBlur(weight, total, {}, sigma_px, sigma_px, cv::BORDER_CONSTANT);
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  cv::Mat texture(gray.size(), CV_32F);
  for (int y = 0; y < gray.rows; ++y) {
    const auto *g = gray.ptr<float>(y), *s = sum.ptr<float>(y), *n = total.ptr<float>(y);
    const auto* k = known.ptr<uchar>(y);
    auto* t = texture.ptr<float>(y);
    for (int x = 0; x < gray.cols; ++x)
      t[x] = k[x] != 0 && s[x] > kDarkest * n[x] ? g[x] * n[x] / s[x] - 1.0f : kUnknown;
  }
  return texture;
}

}  // namespace

PinholeGrid grid_of(const Lens& lens, int width_px) {
  PinholeGrid grid;
  grid.width = std::min(width_px, lens.width);
  grid.height = std::max(
      1, static_cast<int>(std::lround(static_cast<double>(lens.height) * grid.width / lens.width)));
  const double across = static_cast<double>(grid.width) / lens.width;
  const double down = static_cast<double>(grid.height) / lens.height;
  grid.fx = across * lens.fx;
  grid.cx = across * lens.cx;
  grid.fy = down * lens.fy;
  grid.cy = down * lens.cy;
  return grid;
}

cv::Mat to_grid(const cv::Mat& picture, const Lens& lens, const PinholeGrid& grid, bool mask) {
  cv::Mat straight = picture;
  if (!is_pinhole(lens)) {
    const LensProjector projector(lens);
    const PinholeGrid whole = grid_of(lens, lens.width);
    cv::Mat source(picture.size(), CV_32FC2, cv::Scalar::all(-1.0));
    for (int y = 0; y < source.rows; ++y)
      for (int x = 0; x < source.cols; ++x)
        if (const auto pixel = projector.project(whole.ray(x, y)))
          source.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel->x() - 0.5),
                                        static_cast<float>(pixel->y() - 0.5)};
    cv::remap(picture, straight, source, {}, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  }
  cv::Mat wide, small;
  straight.convertTo(wide, CV_32F);
  cv::resize(wide, small, grid.size(), 0.0, 0.0, cv::INTER_AREA);
  return mask ? cv::Mat(small > kWhole) : small;
}

std::vector<StereoImage> stereo_levels(const Frame& frame, const Lens& lens, int width_px,
                                       int levels, int radius_px) {
  check(frame.gray.type() == CV_8U && frame.reflection.size() == frame.gray.size() &&
            frame.valid.size() == frame.gray.size(),
        "stereo_levels: frame {} has no grey picture with its masks", frame.index);
  const cv::Mat known = frame.valid & ~frame.reflection;
  std::vector<StereoImage> images;
  for (int level = 0; level < levels; ++level) {
    const PinholeGrid grid = grid_of(lens, std::max(8, std::min(width_px, lens.width) >> level));
    images.push_back({grid, relative_brightness(to_grid(frame.gray, lens, grid, false),
                                                to_grid(known, lens, grid, true),
                                                kMeanRadii * radius_px)});
  }
  return images;
}

}  // namespace rugae
