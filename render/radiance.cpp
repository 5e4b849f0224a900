#include "render/radiance.h"

#include <cmath>

#include "render/bsdf.h"

namespace rugae {

// L = (wall_retro albedo + coat_retro) I / d^2. The wet layer has its own normal,
// n_coat = normalize(n - g_tangential) with g the slope of its height.
void shade(const PointLight& light, const Tile& tile, const SurfaceTile& surface,
           RadianceTile& radiance) {
  Lanes<float> cosine, coat_cosine, irradiance;
  for (int k = 0; k < surface.count; ++k) {
    const int lane = surface.lane[k];
    const Vec3f to_camera = -tile.direction_world[lane].cast<float>();
    const Vec3f& n = surface.shading_normal[k];
    const Vec3f& g = surface.material[k].coat_gradient;
    const Vec3f tilted = n - (g - n * n.dot(g));
    cosine[k] = n.dot(to_camera);
    coat_cosine[k] = tilted.dot(to_camera) / std::sqrt(tilted.squaredNorm());
    irradiance[k] = static_cast<float>(light.irradiance_facing(tile.hit[lane].range_mm));
  }
  for (int k = 0; k < surface.count; ++k) {
    const MucosaSample& m = surface.material[k];
    const float wall = irradiance[k] * wall_retro(cosine[k], m.coverage, m.f0);
    // A coat turned to the light where the wall itself is turned away gives nothing.
    const float coat =
        cosine[k] > 0.0f ? irradiance[k] * coat_retro(coat_cosine[k], m.roughness, m.coverage, m.f0)
                         : 0.0f;
    radiance.red[k] = wall * m.albedo.x() + coat;
    radiance.green[k] = wall * m.albedo.y() + coat;
    radiance.blue[k] = wall * m.albedo.z() + coat;
    radiance.coat[k] = coat;
  }
}

}  // namespace rugae
