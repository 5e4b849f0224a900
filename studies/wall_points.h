#pragma once
// Points of the true wall: which one a pixel sees, and where it is seen in another frame.

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "dataset/truth.h"
#include "render/raycaster.h"

namespace rugae {

/// A point of the wall, wherever the wall has moved. Within a frame the wall keeps still, at the
/// frame's time: with a rolling shutter the camera alone moves from row to row.
struct WallPoint {
  int triangle = -1;  // -1: none
  float b1 = 0.0f, b2 = 0.0f;
};

class WallPoints {
 public:
  explicit WallPoints(const std::filesystem::path& dataset);

  /// Of each pixel, (0.5, 0.5) convention, of the frame as observed. None where it sees no wall.
  std::vector<WallPoint> seen(int frame, std::span<const Vec2> pixels) const;
  /// Where each point is seen in a frame as observed; empty where it is hidden, outside the picture
  /// or outside the field stop.
  std::vector<std::optional<Vec2>> pixels(int frame, std::span<const WallPoint> points) const;
  /// z-depth, mm, of each ray (camera axes, z = 1) from the camera at the frame's time; NaN where
  /// nothing is met.
  std::vector<double> depths_mm(int frame, std::span<const Vec3> rays) const;

  const Truth& truth() const { return truth_; }

 private:
  struct Wall;  // at a frame's time
  Wall wall(int frame) const;

  Truth truth_;
  Raycaster rest_;
};

}  // namespace rugae
