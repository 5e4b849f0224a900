#include "cameras/rig.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/presets.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

constexpr const char* kPresets = "cameras/rigs";

bool fit_for_folder(const std::string& name) {
  return !name.empty() && name.front() != '.' && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) || c == '-' || c == '_' || c == '.';
  });
}

// Columns are the camera's axes x, y, z in those of the capsule.
Rigid3 read_pose(YamlReader& yaml) {
  Vec3 position_mm = Vec3::Zero(), forward = Vec3::UnitZ(), right = Vec3::UnitX();
  yaml.get("position_mm", position_mm);
  yaml.get("forward", forward);
  yaml.get("right", right);
  for (const auto& [key, axis] : {std::pair{"forward", forward}, std::pair{"right", right}})
    check(axis.norm() > 1e-9, "{}: {} is [{}, {}, {}], expected a direction other than zero",
          yaml.where(key), key, axis.x(), axis.y(), axis.z());
  forward.normalize();
  right.normalize();
  constexpr double kPerpendicular = 1e-6;
  check(std::abs(forward.dot(right)) <= kPerpendicular,
        "{}: right is not perpendicular to forward (cosine {:.3g}, expected at most {})",
        yaml.where("right"), forward.dot(right), kPerpendicular);
  Mat3 axes;
  axes << right, forward.cross(right), forward;
  return {Quat(axes).normalized(), position_mm};
}

RigCamera read_camera(YamlReader yaml, const fs::path& folder) {
  RigCamera entry;
  yaml.require("camera", entry.preset);
  yaml.require("name", entry.name);
  check(fit_for_folder(entry.name),
        "{}: name '{}' is not fit for a folder, expected letters, digits, '-', '_' and '.'",
        yaml.where("name"), entry.name);
  entry.capsule_from_camera = read_pose(yaml);
  yaml.finish();
  try {
    const bool file = fs::path(entry.preset).has_extension();
    entry.camera = load_camera(file ? (folder / entry.preset).string() : entry.preset);
  } catch (const Error& error) {
    fail("{}: {}", yaml.where("camera"), error.what());
  }
  return entry;
}

// Every camera is lit by the lights of all, its own first.
void share_lights(std::vector<RigCamera>& cameras) {
  std::vector<std::vector<Emitter>> own;
  for (const RigCamera& entry : cameras) own.push_back(entry.camera.lights);
  for (std::size_t to = 0; to < cameras.size(); ++to)
    for (std::size_t from = 0; from < cameras.size(); ++from) {
      if (from == to) continue;
      const Rigid3 to_from =
          cameras[to].capsule_from_camera.inverse() * cameras[from].capsule_from_camera;
      auto& lights = cameras[to].camera.lights;
      for (const Emitter& light : moved(own[from], to_from)) lights.push_back(light);
    }
}

}  // namespace

bool is_rig(const std::string& name_or_path) {
  const fs::path path(name_or_path);
  if (!path.has_extension() && name_or_path.find('/') == std::string::npos)
    return std::ranges::count(preset_names(kPresets), name_or_path) > 0;
  if (!fs::exists(path)) return false;
  const YamlReader yaml = YamlReader::from_file(path);
  return yaml.has("kind") || yaml.has("cameras");
}

Rig load_rig(const std::string& name_or_path) {
  const fs::path file = find_preset(kPresets, "rig", name_or_path);
  YamlReader yaml = YamlReader::from_file(file);
  Rig rig;
  int kind = 0;
  yaml.get_choice("kind", {"rig"}, kind);
  rig.name = file.stem().string();
  yaml.get("name", rig.name);
  for (const YamlReader& entry : yaml.children("cameras"))
    rig.cameras.push_back(read_camera(entry, file.parent_path()));
  check(!rig.cameras.empty(), "{}: cameras is empty, expected at least one camera",
        yaml.where("cameras"));
  yaml.finish();
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const RigCamera& entry = rig.cameras[i];
    check(std::ranges::count(rig.cameras, entry.name, &RigCamera::name) == 1,
          "{}: the name '{}' stands twice, expected a name of its own for each camera",
          yaml.where("cameras"), entry.name);
    const double fps = rig.cameras.front().camera.sensor.fps;
    check(entry.camera.sensor.fps == fps,
          "{}: camera '{}' takes {} frames a second and '{}' {}, expected the same for all",
          yaml.where("cameras"), entry.name, entry.camera.sensor.fps, rig.cameras.front().name,
          fps);
  }
  share_lights(rig.cameras);
  return rig;
}

std::string rig_json(const Rig& rig) {
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
  for (const RigCamera& entry : rig.cameras) {
    const Quat& q = entry.capsule_from_camera.rotation;
    const Vec3& t = entry.capsule_from_camera.translation;
    cameras.push_back({{"name", entry.name},
                       {"camera", entry.camera.name},
                       {"capsule_from_camera",
                        {{"translation_mm", {t.x(), t.y(), t.z()}},
                         {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}}}});
  }
  return nlohmann::ordered_json{{"name", rig.name}, {"cameras", cameras}}.dump(2) + "\n";
}

}  // namespace rugae
