#include "render/path_trace.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "render/light.h"
#include "render/scatter.h"

namespace rugae {
namespace {

// Rays from the wall start this far above it: well over single precision (1e-5 mm at 100 mm from
// the middle of the wall), well under its relief.
constexpr double kLift_mm = 1e-3;
// Paths end by chance only once they have seen this many places beyond the first.
constexpr int kSureBounces = 2;
// A path may be cut with at most this chance to go on, so that none can go on for ever in a white
// cavity without ever being asked.
constexpr double kMostSurvival = 0.95;
// The widest cone a ray may stand for: 60 degrees across.
constexpr float kMostSpread_rad = 1.0f;

// The steps of the R4 sequence, powers of the root of x^5 = x + 1, as shares of 2^32: the numbers
// s step + shift fill the unit cube evenly for successive s (Roberts 2018, generalising the golden
// ratio), and each of them alone is uniform since the shift is.
constexpr std::uint32_t kEvenSteps[4] = {3679390609u, 3152041523u, 2700274806u, 2313257605u};

// What to draw a path's direction and its end with. The first bounce is spread evenly over the
// samples of a pixel; later ones are independent.
std::array<double, 4> numbers(std::uint64_t seed, std::uint32_t frame, int pixel, int sample,
                              int bounce) {
  const bool even = bounce == 0;
  const std::uint64_t index = static_cast<std::uint64_t>(pixel) << 24 |
                              static_cast<std::uint64_t>(even ? 0 : sample) << 8 |
                              static_cast<std::uint64_t>(bounce);
  auto words = random_words(seed, Purpose::light_path, frame, index);
  if (even)
    for (int k = 0; k < 4; ++k) words[k] += kEvenSteps[k] * static_cast<std::uint32_t>(sample);
  return {uniform01(words[0]), uniform01(words[1]), uniform01(words[2]), uniform01(words[3])};
}

}  // namespace

struct PathTracer::Work {
  // Of the tile: where paths begin.
  std::vector<ShadedPoint> first{kTileSize};
  Lanes<Vec3> sum;

  // Of the paths on their way; a lane is a path.
  Tile tile;
  SurfaceTile surface;
  Lanes<int> owner;     // index into the tile's surface
  Lanes<Vec3> carried;  // product of f cos / p, RGB
  Lanes<float> spread_rad;

  // Of the places they came to.
  std::vector<ShadedPoint> place{kTileSize};
  Lanes<Vec3> point, add;
  Lanes<Eye> from;
  Lanes<std::uint8_t> lit, hidden;

  // Sends a path on from a place; false where it ends.
  bool send(const ShadedPoint& from_place, const Vec3& from_point, const Vec3& out,
            const std::array<double, 4>& u, int lane_of_sender, int samples, const Vec3& so_far,
            int path);
};

bool PathTracer::Work::send(const ShadedPoint& here, const Vec3& here_mm, const Vec3& out,
                            const std::array<double, 4>& u, int owner_of_path, int samples,
                            const Vec3& so_far, int path) {
  const ScatterSample s = sample_scatter(here, out, u);
  if (!(s.pdf > 0.0)) return false;
  const Scattered f = scatter(here, s.direction, out);
  const Vec3 weight = (f.wall * here.albedo + Vec3::Constant(f.coat)) / s.pdf;
  if (!(weight.maxCoeff() > 0.0)) return false;
  owner[path] = owner_of_path;
  carried[path] = so_far.cwiseProduct(weight);
  tile.eye[path].position_mm = here_mm + kLift_mm * here.geometric_normal;
  tile.direction_world[path] = s.direction;
  // A sample stands for the solid angle 1 / (n p).
  spread_rad[path] =
      std::min(kMostSpread_rad, static_cast<float>(1.0 / std::sqrt(samples * s.pdf)));
  return true;
}

PathTracer::PathTracer(const PathOptions& options)
    : options_(options), work_(std::make_unique<Work>()) {}
PathTracer::~PathTracer() = default;

void PathTracer::trace(std::span<const Emitter> lights, const Wall& wall, const Tile& tile,
                       const SurfaceTile& surface, std::uint32_t frame, Lanes<Vec3f>& indirect) {
  Work& w = *work_;
  Tile& paths = w.tile;
  paths.instants = tile.instants;
  paths.one_eye = false;
  const auto point_of = [](const Tile& t, int lane) -> Vec3 {
    return t.eye_of(lane).position_mm + t.hit[lane].range_mm * t.direction_world[lane];
  };
  const auto place_of = [&wall](const Tile& t, const SurfaceTile& s, int k) {
    const int lane = s.lane[k];
    return ShadedPoint(wall.geometric_normal(t.hit[lane].triangle, t.instant_of(lane).beat),
                       s.shading_normal[k], s.material[k], t.direction_world[lane]);
  };
  for (int k = 0; k < surface.count; ++k) {
    w.first[static_cast<std::size_t>(k)] = place_of(tile, surface, k);
    w.sum[k] = Vec3::Zero();
  }

  for (int sample = 0; sample < options_.samples; ++sample) {
    paths.count = 0;
    for (int k = 0; k < surface.count; ++k) {
      const int lane = surface.lane[k], path = paths.count;
      const auto u = numbers(options_.seed, frame, tile.pixel[lane], sample, 0);
      if (!w.send(w.first[static_cast<std::size_t>(k)], point_of(tile, lane),
                  -tile.direction_world[lane], u, k, options_.samples, Vec3::Ones(), path))
        continue;
      paths.pixel[path] = tile.pixel[lane];
      paths.instant[path] = tile.instant[lane];
      paths.eye[path].beat = tile.instant_of(lane).beat;
      ++paths.count;
    }
    for (int bounce = 1; paths.count > 0; ++bounce) {
      const auto n = static_cast<std::size_t>(paths.count);
      wall.raycaster().intersect(paths.eyes(), {paths.direction_world.data(), n},
                                 {paths.hit.data(), n}, RayOrder::scattered);
      wall.surface().look_up(paths, w.spread_rad, w.surface);
      const int places = w.surface.count;
      if (places == 0) break;
      for (int k = 0; k < places; ++k) {
        w.place[static_cast<std::size_t>(k)] = place_of(paths, w.surface, k);
        w.point[k] = point_of(paths, w.surface.lane[k]);
      }
      for (const Emitter& light : lights) {
        for (int k = 0; k < places; ++k) {
          const int path = w.surface.lane[k];
          const Instant& instant = paths.instant_of(path);
          const PlacedLight placed(light, instant.world_from_camera, instant.camera_mm);
          const ShadedPoint& here = w.place[static_cast<std::size_t>(k)];
          const Arriving arriving = placed.at(w.point[k]);
          const Scattered f = scatter(here, arriving.to_light, -paths.direction_world[path]);
          w.add[k] = arriving.irradiance *
                     w.carried[path].cwiseProduct(f.wall * here.albedo + Vec3::Constant(f.coat));
          w.lit[k] = w.add[k].maxCoeff() > 0.0;
          w.from[k] = {placed.position_mm, instant.beat};
        }
        const auto m = static_cast<std::size_t>(places);
        wall.raycaster().hidden_from(std::span(w.from.data(), tile.one_eye ? 1 : m),
                                     {w.point.data(), m}, {w.lit.data(), m}, {w.hidden.data(), m},
                                     RayOrder::scattered);
        for (int k = 0; k < places; ++k)
          if (w.lit[k] && !w.hidden[k]) w.sum[w.owner[w.surface.lane[k]]] += w.add[k];
      }
      if (bounce == options_.bounces) break;
      // Paths close up: a place's path never lies before it.
      int kept = 0;
      for (int k = 0; k < places; ++k) {
        const int path = w.surface.lane[k];
        const auto u = numbers(options_.seed, frame, paths.pixel[path], sample, bounce);
        Vec3 so_far = w.carried[path];
        if (options_.roulette && bounce >= kSureBounces) {
          const double survival = std::min(kMostSurvival, so_far.maxCoeff());
          if (!(u[3] < survival)) continue;
          so_far /= survival;
        }
        const Vec3 out = -paths.direction_world[path];
        const int pixel = paths.pixel[path], instant = paths.instant[path];
        const double beat = paths.eye[path].beat;
        if (!w.send(w.place[static_cast<std::size_t>(k)], w.point[k], out, u, w.owner[path],
                    options_.samples, so_far, kept))
          continue;
        paths.pixel[kept] = pixel;
        paths.instant[kept] = instant;
        paths.eye[kept].beat = beat;
        ++kept;
      }
      paths.count = kept;
    }
  }
  for (int k = 0; k < surface.count; ++k) indirect[k] = (w.sum[k] / options_.samples).cast<float>();
}

}  // namespace rugae
