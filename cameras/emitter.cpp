#include "cameras/emitter.h"

#include <cmath>

#include "core/check.h"

namespace rugae {
namespace {

constexpr double kMostLobe = 100.0;  // half the light within 7 degrees of the axis
constexpr double kMostOffset_mm = 100.0;

Emitter read_light(YamlReader yaml) {
  Emitter light;
  yaml.get("offset_mm", light.offset_mm);
  yaml.get("axis", light.axis);
  yaml.get("lobe", light.lobe);
  yaml.get("intensity", light.intensity);
  yaml.finish();
  check(light.offset_mm.norm() <= kMostOffset_mm,
        "{}: offset_mm is [{}, {}, {}], expected at most {} mm from the camera",
        yaml.where("offset_mm"), light.offset_mm.x(), light.offset_mm.y(), light.offset_mm.z(),
        kMostOffset_mm);
  const double length = light.axis.norm();
  check(length > 1e-9 && std::isfinite(length),
        "{}: axis is [{}, {}, {}], expected a direction other than zero", yaml.where("axis"),
        light.axis.x(), light.axis.y(), light.axis.z());
  // A unit vector is kept to the last bit, so that what was written reads back the same.
  if (std::abs(length - 1.0) > 1e-15) light.axis /= length;
  check(light.lobe >= 0.0 && light.lobe <= kMostLobe, "{}: lobe is {}, expected 0 to {}",
        yaml.where("lobe"), light.lobe, kMostLobe);
  check(light.intensity > 0.0 && std::isfinite(light.intensity),
        "{}: intensity is {}, expected above 0", yaml.where("intensity"), light.intensity);
  return light;
}

}  // namespace

std::vector<Emitter> read_lights(YamlReader& yaml) {
  std::vector<Emitter> lights;
  for (const YamlReader& light : yaml.children("lights")) lights.push_back(read_light(light));
  if (!yaml.has("lights")) return {Emitter{}};
  check(!lights.empty(), "{}: lights is empty, expected at least one light", yaml.where("lights"));
  return lights;
}

std::string lights_yaml(const std::vector<Emitter>& lights) {
  std::string text = "lights:\n";
  for (const Emitter& light : lights)
    text += fmt::format(
        "  - offset_mm: [{:.17g}, {:.17g}, {:.17g}]\n    axis: [{:.17g}, {:.17g}, {:.17g}]\n"
        "    lobe: {:.17g}\n    intensity: {:.17g}\n",
        light.offset_mm.x(), light.offset_mm.y(), light.offset_mm.z(), light.axis.x(),
        light.axis.y(), light.axis.z(), light.lobe, light.intensity);
  return text;
}

std::vector<Emitter> moved(const std::vector<Emitter>& lights, const Rigid3& to_from_here) {
  std::vector<Emitter> result = lights;
  for (Emitter& light : result) {
    light.offset_mm = to_from_here * light.offset_mm;
    light.axis = (to_from_here.rotation * light.axis).normalized();
  }
  return result;
}

}  // namespace rugae
