#pragma once
// The capsule's lights in the world (cameras/emitter.h has the model).

#include "cameras/emitter.h"
#include "core/portable_math.h"

namespace rugae {

/// exp(-mu (1 - D . w)) for the cosine D . w.
inline double lobe_share(const Emitter& light, double cosine) {
  return light.lobe == 0.0 ? 1.0 : portable_exp(-light.lobe * (1.0 - cosine));
}

/// Light as it arrives at a point. Without a unit: radiance comes out in that of the intensity per
/// mm^2, and the sensor's sensitivity is stated against it (render/sensor.h).
struct Arriving {
  Vec3 to_light;      // unit
  double irradiance;  // on a surface that faces the light: I exp(-mu (1 - D . w)) / d^2
};

/// An emitter while the camera stands in one place.
struct PlacedLight {
  Emitter emitter;
  Vec3 position_mm, axis;  // world

  PlacedLight(const Emitter& e, const Mat3& world_from_camera, const Vec3& camera_mm)
      : emitter(e),
        position_mm(camera_mm + world_from_camera * e.offset_mm),
        axis(world_from_camera * e.axis) {}

  Arriving at(const Vec3& point_mm) const {
    const Vec3 from_light = point_mm - position_mm;
    const double d2 = from_light.squaredNorm(), d = std::sqrt(d2);
    return {from_light / -d,
            emitter.intensity * lobe_share(emitter, axis.dot(from_light) / d) / d2};
  }
};

}  // namespace rugae
