#pragma once
// The usual mistakes in writing poses, each as what undoes it.

#include <functional>
#include <string>
#include <vector>

#include "core/rigid3.h"

namespace rugae {

struct PoseMistake {
  std::string text;  // completes "the poses are wrong: ...": "the rotations are transposed"
  std::function<Rigid3(const Rigid3&)> undo;  // the pose that was meant: world_from_camera, mm
  double factor = 1.0;                        // of lengths in `undo`; the depth's is 1 / factor
};

/// Simple ones first: where several fit alike, the first is meant.
const std::vector<PoseMistake>& pose_mistakes();

/// "a factor 1000: ..." for lengths of poses that have to be multiplied by `factor` to fit the
/// depth, naming the units where the factor is one between units.
std::string scale_mistake(double factor);

}  // namespace rugae
