#include "render/radiance.h"

#include <cmath>

#include "render/bsdf.h"
#include "render/scatter.h"

namespace rugae {
namespace {

// L = (wall_retro albedo + coat_retro) I / d^2. The wet layer has its own normal,
// n_coat = normalize(n - g_tangential) with g the slope of its height.
void add_central_light(const Emitter& light, const Tile& tile, const SurfaceTile& surface,
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
    const double range_mm = tile.hit[lane].range_mm;
    const Vec3 axis = tile.instant_of(lane).world_from_camera * light.axis;
    irradiance[k] = static_cast<float>(light.intensity *
                                       lobe_share(light, axis.dot(tile.direction_world[lane])) /
                                       (range_mm * range_mm));
  }
  for (int k = 0; k < surface.count; ++k) {
    const MucosaSample& m = surface.material[k];
    radiance.wall[k] += irradiance[k] * wall_retro(cosine[k], m.coverage, m.f0);
    // A coat turned to the light where the wall itself is turned away gives nothing.
    if (cosine[k] > 0.0f)
      radiance.coat[k] += irradiance[k] * coat_retro(coat_cosine[k], m.roughness, m.coverage, m.f0);
  }
}

// L = (f_wall albedo + f_coat) cos_in I / d^2, where nothing stands in between.
void add_offset_light(const Emitter& light, const Wall& wall, const Tile& tile,
                      const SurfaceTile& surface, RadianceTile& radiance) {
  Lanes<Vec3> point;
  Lanes<Eye> from;
  Lanes<Scattered> scattered;
  Lanes<std::uint8_t> lit, hidden;
  for (int k = 0; k < surface.count; ++k) {
    const int lane = surface.lane[k];
    const Hit& hit = tile.hit[lane];
    const Vec3& direction = tile.direction_world[lane];
    const Instant& instant = tile.instant_of(lane);
    const PlacedLight placed(light, instant.world_from_camera, instant.camera_mm);
    from[k] = {placed.position_mm, instant.beat};
    point[k] = tile.eye_of(lane).position_mm + hit.range_mm * direction;
    const WallPoint here(wall.geometric_normal(hit.triangle, instant.beat),
                         surface.shading_normal[k], surface.material[k], direction);
    const Arriving arriving = placed.at(point[k]);
    const Scattered f = scatter(here, arriving.to_light, -direction);
    scattered[k] = {f.wall * arriving.irradiance, f.coat * arriving.irradiance};
    lit[k] = scattered[k].wall > 0.0 || scattered[k].coat > 0.0;
  }
  const auto n = static_cast<std::size_t>(surface.count);
  if (n == 0) return;
  wall.raycaster().hidden_from(std::span(from.data(), tile.one_eye ? 1 : n), {point.data(), n},
                               {lit.data(), n}, {hidden.data(), n});
  for (int k = 0; k < surface.count; ++k) {
    if (!lit[k] || hidden[k]) continue;
    radiance.wall[k] += static_cast<float>(scattered[k].wall);
    radiance.coat[k] += static_cast<float>(scattered[k].coat);
  }
}

}  // namespace

void shade(std::span<const Emitter> lights, const Wall& wall, const Tile& tile,
           const SurfaceTile& surface, RadianceTile& radiance) {
  std::fill_n(radiance.wall.begin(), surface.count, 0.0f);
  std::fill_n(radiance.coat.begin(), surface.count, 0.0f);
  for (const Emitter& light : lights) {
    if (light.central())
      add_central_light(light, tile, surface, radiance);
    else
      add_offset_light(light, wall, tile, surface, radiance);
  }
}

}  // namespace rugae
