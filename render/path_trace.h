#pragma once
// Light that comes to the camera over one or more other places of the wall.

#include <cstdint>
#include <memory>
#include <span>

#include "cameras/emitter.h"
#include "render/wall.h"

namespace rugae {

inline constexpr int kMostBounces = 255;
inline constexpr int kMostPaths = 65535;

struct PathOptions {
  int bounces = 0;   // 1 to kMostBounces; 0: no light from other walls
  int samples = 16;  // paths a pixel, 1 to kMostPaths
  bool roulette = true;
  std::uint64_t seed = 1;
};

/// Paths from the tile's hits on: at every further place of the wall the light that comes straight
/// from the emitters is added (next-event estimation; a point can not be met by chance, so nothing
/// is counted twice), and a path goes on in proportion to what the wall scatters. From the third
/// place on it ends by chance, with the survivors counting for the others (Russian roulette), which
/// changes the noise and not the mean. After k bounces
///
///   L = sum over j = 1 to k of  E[ prod_{i<j} f_i cos_i / p_i  *  direct(x_j) ].
///
/// Random numbers are a function of (seed, frame, pixel, sample, bounce) alone.
class PathTracer {
 public:
  explicit PathTracer(const PathOptions& options);
  ~PathTracer();

  /// Mean over the paths, linear RGB towards the camera, of the lanes of `surface`.
  void trace(std::span<const Emitter> lights, const Wall& wall, const Tile& tile,
             const SurfaceTile& surface, std::uint32_t frame, Lanes<Vec3f>& indirect);

 private:
  struct Work;
  PathOptions options_;
  std::unique_ptr<Work> work_;  // of one thread
};

}  // namespace rugae
