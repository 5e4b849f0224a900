#pragma once
// Numbers as text for the page: little-endian arrays in base64, as JavaScript's typed arrays read
// them.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/mesh.h"

namespace rugae::packed {

/// Float32Array.
std::string floats(const std::vector<double>& values);
/// Float32Array of x y z x y z ...
std::string points(const std::vector<Vec3>& points_mm);
/// Uint8Array: 0 at 0, 255 at `top` and above; values must be at least 0 and `top` more than 0.
std::string shares(const std::vector<double>& values, double top);

/// {"corner_mm": [x, y, z], "step_mm", "points": Uint16Array, "triangles": Uint16Array, or
/// Uint32Array where "wide"}: a coordinate is corner + step * number, so it is off by half a step
/// at most, which is 1/131070 of the mesh's longest side.
nlohmann::json mesh(const TriangleMesh& mesh);

}  // namespace rugae::packed
