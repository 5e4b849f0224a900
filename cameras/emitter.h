#pragma once
// The lights beside a camera.

#include <algorithm>
#include <string>
#include <vector>

#include "core/rigid3.h"
#include "core/yaml.h"

namespace rugae {

/// A point that shines into a lobe around its axis: at the distance d in the unit direction w from
/// it, a surface turned towards it receives
///
///   L(x) = I exp(-mu (1 - D . w)) / d^2
///
/// with the axis D and the lobe mu; mu = 0 shines alike in every direction (the photometric model
/// of EndoMapper: Batlle, Montiel and Tardos, Photometric single-view dense 3D reconstruction in
/// endoscopy, IROS 2022).
struct Emitter {
  Vec3 offset_mm = Vec3::Zero();  // from the camera's centre, camera axes
  Vec3 axis = Vec3::UnitZ();      // unit, camera axes
  double lobe = 0.0;              // mu
  double intensity = 1.0;         // along the axis; one emitter of 1 is what the sensor is set for

  /// It lights exactly what the camera sees: no shadow of it is ever seen.
  bool central() const { return offset_mm.isZero(0.0); }
};

/// No light stands beside the camera.
inline bool all_central(const std::vector<Emitter>& lights) {
  return std::all_of(lights.begin(), lights.end(), [](const Emitter& l) { return l.central(); });
}

/// The list under the key "lights"; where there is none, one ideal emitter at the camera's centre.
/// Throws Error with file, line and column: an empty list, an axis without direction, an intensity
/// not above 0, a lobe outside 0 to 100, an offset of more than 100 mm.
std::vector<Emitter> read_lights(YamlReader& yaml);

/// As YAML that read_lights reads back to the same values.
std::string lights_yaml(const std::vector<Emitter>& lights);

/// The same lights as seen from another camera of the same capsule.
std::vector<Emitter> moved(const std::vector<Emitter>& lights, const Rigid3& to_from_here);

}  // namespace rugae
