#pragma once
// Frames as the correlation compares them: a small pinhole, brightness relative to its
// neighbourhood.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "cameras/camera.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

/// A pinhole without distortion; pixel centres at half numbers.
struct PinholeGrid {
  int width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;

  cv::Size size() const { return {width, height}; }
  /// Ray with z = 1 through the centre of pixel (x, y).
  Vec3 ray(int x, int y) const { return {(x + 0.5 - cx) / fx, (y + 0.5 - cy) / fy, 1.0}; }
  Vec2 project(const Vec3& p_cam) const {
    return {fx * p_cam.x() / p_cam.z() + cx, fy * p_cam.y() / p_cam.z() + cy};
  }
};

/// The same view with another number of pixels; `width_px` at most that of the lens. Distortion is
/// left out: to_grid() undoes it.
PinholeGrid grid_of(const Lens& lens, int width_px);

/// A picture of the lens on the grid, averaged over each pixel's area (masks: 255 only where all of
/// the area was). Of a lens with distortion it is straightened first.
cv::Mat to_grid(const cv::Mat& picture, const Lens& lens, const PinholeGrid& grid, bool mask);

/// One level of a frame.
struct StereoImage {
  PinholeGrid grid;
  /// CV_32F: brightness over the mean around it, minus one; NaN where a reflection was or nothing
  /// is seen. The light moves with the camera: its fall-off over a window, which would pull on the
  /// correlation, is in the mean.
  cv::Mat texture;
};

/// Levels of a frame for `radius_px` windows, the finest first, each half as wide as the one
/// before.
std::vector<StereoImage> stereo_levels(const Frame& frame, const Lens& lens, int width_px,
                                       int levels, int radius_px);

}  // namespace rugae
