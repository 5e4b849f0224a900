#include "render/radiance.h"

#include <cmath>

#include "render/bsdf.h"
#include "render/scatter.h"

namespace rugae {
namespace {

// Lanes up to a multiple of four.
int in_fours(int count) { return (count + 3) / 4 * 4; }

// L = (wall_retro albedo + coat_retro) I / d^2. The wet layer has its own normal,
// n_coat = normalize(n - g_tangential) with g the slope of its height.
void add_central_light(const Emitter& light, const Tile& tile, const SurfaceTile& surface,
                       RadianceTile& radiance) {
  alignas(16) Lanes<float> cosine, coat_dot, tilted2, irradiance, roughness, coverage, f0;
  for (int k = 0; k < surface.count; ++k) {
    const int lane = surface.lane[k];
    const Vec3f to_camera = -tile.direction_world[lane].cast<float>();
    const Vec3f& n = surface.shading_normal[k];
    const MucosaSample& m = surface.material[k];
    const Vec3f& g = m.coat_gradient;
    const Vec3f tilted = n - (g - n * n.dot(g));
    cosine[k] = n.dot(to_camera);
    coat_dot[k] = tilted.dot(to_camera);
    tilted2[k] = tilted.squaredNorm();
    roughness[k] = m.roughness;
    coverage[k] = m.coverage;
    f0[k] = m.f0;
    const double range_mm = tile.hit[lane].range_mm;
    double share = 1.0;
    if (light.lobe > 0.0) {
      const Vec3 axis = tile.instant_of(lane).world_from_camera * light.axis;
      share = lobe_share(light, axis.dot(tile.direction_world[lane]));
    }
    irradiance[k] = static_cast<float>(light.intensity * share / (range_mm * range_mm));
  }
  for (auto* lanes : {&cosine, &coat_dot, &tilted2, &irradiance, &roughness, &coverage, &f0})
    std::fill(lanes->begin() + surface.count, lanes->begin() + in_fours(surface.count), 1.0f);
  for (int k = 0; k < surface.count; k += 4) {
    const auto of = [k](const Lanes<float>& lanes) { return _mm_load_ps(&lanes[k]); };
    const auto add = [k](Lanes<float>& sum, Float4 v) {
      _mm_store_ps(&sum[k], _mm_load_ps(&sum[k]) + v);
    };
    const Float4 wet = of(coverage), fresnel = of(f0), facing = of(cosine);
    add(radiance.wall, of(irradiance) * wall_retro(facing, wet, fresnel));
    // A coat turned to the light where the wall itself is turned away gives nothing.
    const Float4 coat = coat_retro(of(coat_dot) / root(of(tilted2)), of(roughness), wet, fresnel);
    add(radiance.coat, of(irradiance) * where_positive(facing, coat));
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
    const ShadedPoint here(wall.geometric_normal(hit.triangle, instant.beat),
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
  std::fill_n(radiance.wall.begin(), in_fours(surface.count), 0.0f);
  std::fill_n(radiance.coat.begin(), in_fours(surface.count), 0.0f);
  for (const Emitter& light : lights) {
    if (light.central())
      add_central_light(light, tile, surface, radiance);
    else
      add_offset_light(light, wall, tile, surface, radiance);
  }
}

}  // namespace rugae
