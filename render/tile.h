#pragma once
// A tile of pixels on its way through the stages: rays, hits, and what is worked out about them, as
// arrays of equal length.

#include <array>
#include <cstdint>

#include "render/exact_hit.h"
#include "render/ray_table.h"

namespace rugae {

inline constexpr int kTileWidth = 64, kTileHeight = 16;
inline constexpr int kTileSize = kTileWidth * kTileHeight;

template <typename T>
using Lanes = std::array<T, kTileSize>;

struct Tile {
  int count = 0;     // lanes in use
  Lanes<int> pixel;  // index into the ray table, in 4 x 4 blocks so that packets stay together
  Lanes<Vec3> direction_world;
  Lanes<Hit> hit;
};

/// Fills pixel and direction_world for the tile whose first pixel is (x0, y0).
inline void place_tile(const RayTable& rays, const Mat3& world_from_camera, int x0, int y0,
                       Tile& tile) {
  constexpr int kBlock = 4;
  const int x1 = std::min(x0 + kTileWidth, rays.width),
            y1 = std::min(y0 + kTileHeight, rays.height);
  tile.count = 0;
  for (int yb = y0; yb < y1; yb += kBlock)
    for (int xb = x0; xb < x1; xb += kBlock)
      for (int y = yb; y < std::min(yb + kBlock, y1); ++y)
        for (int x = xb; x < std::min(xb + kBlock, x1); ++x) {
          const int i = y * rays.width + x;
          tile.pixel[tile.count] = i;
          tile.direction_world[tile.count] = world_from_camera * rays.directions_cam[i];
          ++tile.count;
        }
}

}  // namespace rugae
