#include "render/ray_table.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace rugae {

RayTable make_ray_table(const Lens& lens, const Vignetting& vignetting) {
  lens.check("camera");
  const LensProjector projector(lens);
  RayTable table;
  table.width = lens.width;
  table.height = lens.height;
  const std::size_t size = static_cast<std::size_t>(lens.width) * lens.height;
  table.directions_cam.assign(size, Vec3::Zero());
  table.vignetting.assign(size, 0.0f);
  table.pixel_angle_rad.assign(size, 0.0f);
  tbb::parallel_for(0, lens.height, [&](int y) {
    for (int x = 0; x < lens.width; ++x) {
      const Vec2 pixel(x + 0.5, y + 0.5);
      const auto ray = projector.unproject(pixel);
      if (!ray) continue;
      const std::size_t i = static_cast<std::size_t>(y) * lens.width + x;
      table.directions_cam[i] = *ray;
      table.vignetting[i] = static_cast<float>(vignette_at(vignetting, lens, pixel, *ray));
    }
  });
  // The solid angle of a pixel is |dw/dx x dw/dy|, by differences to the neighbours inside.
  const auto at = [&](int x, int y) -> const Vec3& {
    return table.directions_cam[static_cast<std::size_t>(y) * lens.width + x];
  };
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const int x0 = std::max(0, x - 1), x1 = std::min(lens.width - 1, x + 1);
      const int y0 = std::max(0, y - 1), y1 = std::min(lens.height - 1, y + 1);
      const Vec3 dx = (at(x1, y) - at(x0, y)) / std::max(1, x1 - x0);
      const Vec3 dy = (at(x, y1) - at(x, y0)) / std::max(1, y1 - y0);
      table.pixel_angle_rad[static_cast<std::size_t>(y) * lens.width + x] =
          static_cast<float>(std::sqrt(dx.cross(dy).norm()));
    }
  }
  // The stop comes last: the pixels beside it keep their size.
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x)
      if (!lens.passes_stop({x + 0.5, y + 0.5})) {
        const std::size_t i = static_cast<std::size_t>(y) * lens.width + x;
        table.directions_cam[i] = Vec3::Zero();
        table.vignetting[i] = 0.0f;
      }
  return table;
}

}  // namespace rugae
