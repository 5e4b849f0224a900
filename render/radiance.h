#pragma once
// Light that comes back from the wall to the camera.

#include "render/light.h"
#include "render/surface.h"

namespace rugae {

/// Linear RGB radiance towards the camera of the lanes of a SurfaceTile, split by origin.
struct RadianceTile {
  Lanes<float> red, green, blue;  // of both
  Lanes<float> coat;              // of the wet layer alone, the same in every channel
};

/// Direct light of one emitter at the camera centre, no bounces.
void shade(const PointLight& light, const Tile& tile, const SurfaceTile& surface,
           RadianceTile& radiance);

/// The wet layer's reflection adds more than this share of the pixel's luminance: a specular pixel.
inline constexpr float kSpecularShare = 0.25f;

/// Luminance of linear RGB (ITU-R BT.709).
inline float luminance(float red, float green, float blue) {
  return 0.2126f * red + 0.7152f * green + 0.0722f * blue;
}

}  // namespace rugae
