#pragma once
// The pixels of a depth map: a pinhole that sees all that the lens sees.

#include <opencv2/core/types.hpp>

#include "cameras/camera.h"

namespace rugae {

/// A pinhole without distortion; the centre of the first pixel is (0.5, 0.5).
struct PinholeGrid {
  int width = 0, height = 0;                      // px
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  // px

  cv::Size size() const { return {width, height}; }
  /// Ray with z = 1 through the centre of pixel (x, y).
  Vec3 ray(int x, int y) const { return {(x + 0.5 - cx) / fx, (y + 0.5 - cy) / fy, 1.0}; }
  /// Of a point in front of the camera.
  Vec2 project(const Vec3& p_cam) const {
    return {fx * p_cam.x() / p_cam.z() + cx, fy * p_cam.y() / p_cam.z() + cy};
  }
  bool contains(const Vec2& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width && pixel.y() < height;
  }
};

/// The grid over everything that the lens sees within 62 degrees of its axis, which a picture
/// straightened to the lens' own size crops: with barrel distortion the outer fifth each way, where
/// a wall is often seen that nothing else shows. `width_px` wide, or as wide as it takes to be
/// nowhere finer than the lens.
PinholeGrid wide_grid(const Lens& lens, int width_px);

/// The same view with half as many pixels each way, rounded up.
PinholeGrid halved(const PinholeGrid& grid);

}  // namespace rugae
