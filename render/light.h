#pragma once
// The capsule's light.

#include "core/units.h"

namespace rugae {

/// One ideal point emitter at the camera centre: it lights exactly what the camera sees, so it
/// casts no visible shadow and needs no shadow rays. Without a unit: radiance comes out in the same
/// unit per mm^2, and the sensor's sensitivity is stated against it (render/sensor.h).
struct PointLight {
  double intensity = 1.0;

  // E = I cos(theta) / d^2; the cosine belongs to the surface.
  double irradiance_facing(double range_mm) const { return intensity / (range_mm * range_mm); }
};

}  // namespace rugae
