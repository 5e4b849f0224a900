#pragma once
// The turn of a camera between two frames, sought where the files do not give it.

#include <functional>
#include <vector>

#include "core/types.h"

namespace rugae {

/// Rotation vectors, rad: of the camera, and of the direction of its step.
using Turns = Eigen::Matrix<double, 6, 1>;

/// The rotation about `turn_rad` by its length.
Quat rotation_of(const Vec3& turn_rad);

/// The turns with the least errors (relative, from `errors_of`): a pattern search from no turn of
/// the camera and from seven directions of its step.
Turns best_turns(const std::function<std::vector<double>(const Turns&)>& errors_of);

}  // namespace rugae
