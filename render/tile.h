#pragma once
// A tile of pixels on its way through the stages: rays, hits, and what is worked out about them, as
// arrays of equal length.

#include <array>
#include <cstdint>
#include <span>

#include "render/ray_table.h"
#include "render/raycaster.h"

namespace rugae {

inline constexpr int kTileWidth = 64, kTileHeight = 16;
inline constexpr int kTileSize = kTileWidth * kTileHeight;

template <typename T>
using Lanes = std::array<T, kTileSize>;

/// The camera at the time of a ray.
struct Instant {
  Mat3 world_from_camera = Mat3::Identity();  // rotation alone
  Vec3 camera_mm = Vec3::Zero();
  double beat = 0.0;  // of the wall
};

struct Tile {
  int count = 0;     // lanes in use
  Lanes<int> pixel;  // index into the ray table, in 4 x 4 blocks so that packets stay together
  Lanes<int> column, row;  // of the pixel
  std::span<const Instant> instants;
  Lanes<int> instant;   // index into instants
  bool one_eye = true;  // eye[0] is that of every lane
  Lanes<Eye> eye;
  Lanes<Vec3> direction_world;
  Lanes<Hit> hit;

  const Instant& instant_of(int lane) const {
    return instants[static_cast<std::size_t>(instant[lane])];
  }
  const Eye& eye_of(int lane) const { return eye[one_eye ? 0 : lane]; }
  std::span<const Eye> eyes() const {
    return {eye.data(), one_eye ? 1 : static_cast<std::size_t>(count)};
  }
};

/// Fills the pixels of the tile whose first is (x0, y0).
inline void place_pixels(const RayTable& rays, int x0, int y0, Tile& tile) {
  constexpr int kBlock = 4;
  const int x1 = std::min(x0 + kTileWidth, rays.width),
            y1 = std::min(y0 + kTileHeight, rays.height);
  tile.count = 0;
  for (int yb = y0; yb < y1; yb += kBlock)
    for (int xb = x0; xb < x1; xb += kBlock)
      for (int y = yb; y < std::min(yb + kBlock, y1); ++y)
        for (int x = xb; x < std::min(xb + kBlock, x1); ++x) {
          tile.column[tile.count] = x;
          tile.row[tile.count] = y;
          tile.pixel[tile.count++] = y * rays.width + x;
        }
}

/// Fills the rays of the tile whose first pixel is (x0, y0): through the pixels' centres, at one
/// instant for all of them or at one for each row.
inline void place_tile(const RayTable& rays, std::span<const Instant> instants, int x0, int y0,
                       Tile& tile) {
  place_pixels(rays, x0, y0, tile);
  tile.instants = instants;
  tile.one_eye = instants.size() == 1;
  for (int lane = 0; lane < tile.count; ++lane) {
    const int i = tile.pixel[lane];
    tile.instant[lane] = tile.one_eye ? 0 : tile.row[lane];
    const Instant& instant = tile.instant_of(lane);
    tile.eye[lane] = {instant.camera_mm, instant.beat};
    tile.direction_world[lane] = instant.world_from_camera * rays.directions_cam[i];
  }
}

}  // namespace rugae
