#include "recon/dense/pinhole_grid.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/units.h"

namespace rugae {
namespace {

/// Beyond this angle a pinhole stretches the picture more than twofold along the radius.
constexpr double kWidestRad = 62.0 * kPi / 180.0;
constexpr int kSteps = 64;  // along each border, and from it to the middle

}  // namespace

PinholeGrid wide_grid(const Lens& lens, int width_px) {
  const LensProjector projector(lens);
  const double widest = std::tan(kWidestRad);
  Eigen::AlignedBox2d box;  // of x/z and y/z
  // From each place on the border inwards, as far as the lens sees; at `widest` the ray is cut.
  const auto reach = [&](const Vec2& border) {
    const Vec2 middle(lens.cx, lens.cy);
    for (int i = kSteps; i > 0; --i) {
      const Vec2 pixel = middle + static_cast<double>(i) / kSteps * (border - middle);
      const auto ray = projector.unproject(pixel);
      if (!ray || !(ray->z() > 0.0) || !lens.passes_stop(pixel)) continue;
      const Vec2 slope = ray->head<2>() / ray->z();
      box.extend(Vec2(slope * std::min(1.0, widest / std::max(widest, slope.norm()))));
      return;
    }
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    reach({share * lens.width, 0.0});
    reach({share * lens.width, static_cast<double>(lens.height)});
    reach({0.0, share * lens.height});
    reach({static_cast<double>(lens.width), share * lens.height});
  }
  check(!box.isEmpty() && box.sizes().minCoeff() > 0.0, "the lens sees nothing");
  const double focal = std::min(width_px / box.sizes().x(), std::max(lens.fx, lens.fy));
  PinholeGrid grid;
  grid.width = std::max(8, static_cast<int>(std::lround(focal * box.sizes().x())));
  grid.height = std::max(8, static_cast<int>(std::lround(focal * box.sizes().y())));
  grid.fx = grid.fy = focal;
  grid.cx = -focal * box.min().x();
  grid.cy = -focal * box.min().y();
  return grid;
}

PinholeGrid halved(const PinholeGrid& grid) {
  return {(grid.width + 1) / 2, (grid.height + 1) / 2, 0.5 * grid.fx,
          0.5 * grid.fy,        0.5 * grid.cx,         0.5 * grid.cy};
}

}  // namespace rugae
