#pragma once
// What of a camera does not change from frame to frame, one entry a pixel, row by row.

#include <vector>

#include "cameras/camera.h"

namespace rugae {

struct RayTable {
  int width = 0, height = 0;
  std::vector<Vec3>
      directions_cam;             // unit, through pixel centres; zero where the lens sees nothing
  std::vector<float> vignetting;  // 1 on the axis
  std::vector<float> pixel_angle_rad;  // square root of the solid angle a pixel sees

  std::size_t size() const { return directions_cam.size(); }
};

/// Exact inverse of the lens for every pixel, computed by all threads of the caller's arena.
RayTable make_ray_table(const Lens& lens, const Vignetting& vignetting);

}  // namespace rugae
