#include "recon/dense/place_by_patches.h"

#include "recon/tracks.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;

}  // namespace

std::optional<Placement> place_by_patches(const std::vector<const WallPatch*>& patches,
                                          const PatchImage& image, const MovingPose& guess,
                                          const PatchRegistrar& registrar,
                                          const RollingShutter& shutter, double search_px,
                                          const BundleOptions& options) {
  const Lens& lens = shutter.lens();
  const double reach_px = search_px * lens.width / kReferenceWidthPx;
  std::vector<Vec3> points;
  std::vector<Vec2> rays;
  for (const WallPatch* patch : patches) {
    const auto sight = foretell(*patch, guess, shutter);
    if (!sight) continue;
    const auto pixel = registrar.find(*patch, *sight, image, reach_px);
    const auto ray = pixel ? ray_of(shutter.projector(), *pixel) : std::nullopt;
    if (!ray) continue;
    const double depth = (guess.cam_from_world * patch->centre).z();
    points.push_back(patch->centre);
    rays.push_back(shutter.ray_at_frame_time(*ray, depth, guess.motion));
  }
  return place_by_points(points, rays, lens.fx, options);
}

}  // namespace rugae
