#pragma once
// Light that comes from the lights to the wall and straight back to the camera.

#include <span>

#include "render/light.h"
#include "render/wall.h"

namespace rugae {

/// Linear radiance towards the camera of the lanes of a SurfaceTile, split by origin:
/// RGB = wall albedo + coat.
struct RadianceTile {
  alignas(16) Lanes<float> wall;  // for an albedo of 1
  alignas(16) Lanes<float> coat;  // of the wet layer, the same in every channel
};

/// Direct light of all emitters. One at the camera's centre lights what the camera sees; for the
/// others a ray from the light decides whether wall stands in between.
void shade(std::span<const Emitter> lights, const Wall& wall, const Tile& tile,
           const SurfaceTile& surface, RadianceTile& radiance);

/// The wet layer's reflection adds more than this share of the pixel's luminance: a specular pixel.
inline constexpr float kSpecularShare = 0.25f;

/// Luminance of linear RGB (ITU-R BT.709).
inline float luminance(float red, float green, float blue) {
  return 0.2126f * red + 0.7152f * green + 0.0722f * blue;
}

}  // namespace rugae
