#pragma once
// Several cameras on one capsule. Presets: cameras/rigs/presets/*.yaml.
//
//   kind: rig
//   cameras:
//     - {name: left, camera: misumi-v3506, position_mm: [-2, 0, 0]}
//     - {name: right, camera: misumi-v3506, position_mm: [2, 0, 0], forward: [0, 0, 1], right: [1,
//     0, 0]}
//
// The path is that of the capsule; world_from_camera = world_from_capsule capsule_from_camera.

#include <string>
#include <vector>

#include "cameras/camera.h"
#include "core/rigid3.h"

namespace rugae {

struct RigCamera {
  std::string name;    // of its folder
  std::string preset;  // preset or file the camera comes from
  Camera camera;       // its lights are those of the whole capsule, in its own axes
  Rigid3 capsule_from_camera;
};

struct Rig {
  std::string name;
  std::vector<RigCamera> cameras;
};

/// Whether a name or file is a rig's rather than a camera's. False for what is neither.
bool is_rig(const std::string& name_or_path);

/// A preset name or a YAML file. A camera that is not a preset is a file, relative to the rig's.
/// Throws Error with file, line and column: no cameras, a name that stands twice or is not fit for
/// a folder, an unknown camera, axes that are not perpendicular, cameras of different frame rates.
Rig load_rig(const std::string& name_or_path);

/// What makes a set of datasets a rig, as JSON: names, cameras and poses.
std::string rig_json(const Rig& rig);

}  // namespace rugae
