#include "cameras/lens_difference.h"

#include <cmath>
#include <vector>

#include "core/check.h"

namespace rugae {
namespace {

constexpr int kCells = 32;  // of the grid, along the width and along the height

// The picture's corner, or where the line to it leaves the field stop.
Vec2 corner_towards(const Lens& lens, const Vec2& corner) {
  if (lens.passes_stop(corner)) return corner;
  const Vec2 centre(lens.cx, lens.cy);
  constexpr int kBisections = 40;
  double low = 0.0, high = 1.0;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (lens.passes_stop(centre + middle * (corner - centre)) ? low : high) = middle;
  }
  return centre + low * (corner - centre);
}

}  // namespace

LensDifference compare(const Lens& found, const Lens& truth) {
  check(found.width == truth.width && found.height == truth.height,
        "lenses of {} x {} and {} x {} px cannot be compared", found.width, found.height,
        truth.width, truth.height);
  const LensProjector of_found(found), of_truth(truth);
  const auto apart2 = [&](const Vec2& pixel) {
    const auto ray = of_truth.unproject(pixel);
    check(ray.has_value(), "the true lens has no ray at ({}, {})", pixel.x(), pixel.y());
    const auto seen = of_found.project(*ray);
    check(seen.has_value(), "the lens does not see the ray of the true one's pixel ({}, {})",
          pixel.x(), pixel.y());
    return (*seen - pixel).squaredNorm();
  };
  const double w = truth.width, h = truth.height;
  double sum = 0.0, corners = 0.0;
  int count = 0;
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i) {
      const Vec2 pixel(w * i / kCells, h * j / kCells);
      if (!truth.passes_stop(pixel)) continue;
      sum += apart2(pixel);
      ++count;
    }
  for (const Vec2& corner : {Vec2(0, 0), Vec2(w, 0), Vec2(0, h), Vec2(w, h)})
    corners += 0.25 * apart2(corner_towards(truth, corner));
  return {.focal_share = 0.5 * (found.fx / truth.fx + found.fy / truth.fy) - 1.0,
          .principal_point_px = Vec2(found.cx - truth.cx, found.cy - truth.cy).norm(),
          .projection_rms_px = std::sqrt(sum / count),
          .projection_corner_px = std::sqrt(corners)};
}

Lens perturbed(const Lens& lens, double share) {
  check(std::isfinite(share) && share > -1.0, "a lens cannot be wrong by {}, expected above -1",
        share);
  Lens wrong = lens;
  for (double* value :
       {&wrong.fx, &wrong.fy, &wrong.k1, &wrong.k2, &wrong.k3, &wrong.k4, &wrong.p1, &wrong.p2})
    *value *= 1.0 + share;
  wrong.check(fmt::format("a lens wrong by {}", share));
  return wrong;
}

}  // namespace rugae
