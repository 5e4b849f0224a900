#pragma once
// Real meshes and pictures, beside the project where somebody has put them. A function and not a
// definition on every test's command line, which would keep one tree's objects from another.

#include <filesystem>

#include "core/presets.h"

namespace rugae {

inline std::filesystem::path shared_data() { return preset_root() / ".." / "shared" / "data"; }

}  // namespace rugae
