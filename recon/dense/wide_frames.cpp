#include "recon/dense/wide_frames.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/preprocess/devignette.h"
#include "recon/preprocess/reflections.h"

namespace rugae {
namespace {

constexpr double kWhole = 254.5;  // of a mask averaged over a pixel's area
constexpr float kNowhere = -10.0f;

/// In OpenCV's convention, where the centre of the first pixel is (0, 0).
cv::Vec2f place_of(const Vec2& pixel) {
  return {static_cast<float>(pixel.x() - 0.5), static_cast<float>(pixel.y() - 0.5)};
}

/// Relative to the profile that preprocessing found on its own pixels.
cv::Mat gain_on(const PinholeGrid& grid, const FrameSource& frames) {
  cv::Mat gain(grid.size(), CV_32F, cv::Scalar(1.0));
  const Lens& lens = frames.lens();
  const VignettingProfile profile{
      {lens.cx, lens.cy}, 0.5 * std::hypot(lens.width, lens.height), frames.vignetting_profile()};
  if (profile.v.empty()) return gain;
  const LensProjector projector(lens);
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x) {
      const auto pixel = projector.project(grid.ray(x, y));
      const double radius = pixel ? (*pixel - profile.center_px).norm() : profile.reach_px;
      gain.at<float>(y, x) = static_cast<float>(1.0 / profile.at(radius));
    }
  return gain;
}

}  // namespace

WideFrames::WideFrames(const FrameSource& frames, const ReflectionOptions& reflections,
                       int width_px)
    : frames_(frames),
      reflections_(reflections),
      grid_(wide_grid(frames.observations().lens(), width_px)) {
  const Lens& lens = frames.observations().lens();
  oversampling_ = std::max(1, static_cast<int>(std::lround(lens.fx / grid_.fx)));
  const LensProjector projector(lens);
  source_ = cv::Mat(grid_.height * oversampling_, grid_.width * oversampling_, CV_32FC2,
                    cv::Scalar::all(kNowhere));
  for (int y = 0; y < source_.rows; ++y)
    for (int x = 0; x < source_.cols; ++x) {
      if (const auto pixel = projector.project(ray(x, y)); pixel && lens.contains(*pixel))
        source_.at<cv::Vec2f>(y, x) = place_of(*pixel);
    }
  gain_ = gain_on(grid_, frames);
}

Vec3 WideFrames::ray(int x, int y) const {
  const double step = 1.0 / oversampling_;
  return {(step * (x + 0.5) - grid_.cx) / grid_.fx, (step * (y + 0.5) - grid_.cy) / grid_.fy, 1.0};
}

cv::Mat WideFrames::straightened(const cv::Mat& picture, const cv::Mat& source) const {
  cv::Mat large, wide, small;
  cv::remap(picture, large, source, {}, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  large.convertTo(wide, CV_32F);
  cv::resize(wide, small, grid_.size(), 0.0, 0.0, cv::INTER_AREA);
  return small;
}

WideFrame WideFrames::read(int index) const { return read(index, source_); }

WideFrame WideFrames::read(int index, const CameraMotion& motion, const cv::Mat& depth) const {
  const RollingShutter& shutter = frames_.shutter();
  cv::Mat finer, source(source_.size(), CV_32FC2, cv::Scalar::all(kNowhere));
  cv::resize(depth, finer, source.size(), 0.0, 0.0, cv::INTER_LINEAR);
  for (int y = 0; y < source.rows; ++y)
    for (int x = 0; x < source.cols; ++x) {
      const auto seen = shutter.when_seen(finer.at<float>(y, x) * ray(x, y), motion);
      const auto pixel = seen ? shutter.project_original(*seen) : std::nullopt;
      if (pixel && shutter.original().contains(*pixel))
        source.at<cv::Vec2f>(y, x) = place_of(*pixel);
    }
  return read(index, source);
}

WideFrame WideFrames::read(int index, const cv::Mat& source) const {
  const cv::Mat bgr = frames_.observations().image(index);
  cv::Mat gray;
  cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
  const cv::Mat reflection = detect_reflections(gray, reflections_, frames_.field());
  const cv::Mat known = frames_.field() & ~reflection;
  return {straightened(bgr, source), straightened(known, source) > kWhole};
}

}  // namespace rugae
