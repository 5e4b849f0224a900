#pragma once
// A camera as the YAML text that load_camera reads.

#include <string>

#include "cameras/camera.h"

namespace rugae {

/// Every field with 17 significant digits: reading gives back the same camera.
std::string camera_yaml(const Camera& camera);

}  // namespace rugae
