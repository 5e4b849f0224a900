#pragma once
// Faults of poses that no list of readings holds: they have a number to be searched for.

#include <optional>
#include <string>

#include "dataset/evidence.h"

namespace rugae {

/// A line when all rotations are the same though the camera turns.
std::optional<std::string> frozen_rotation(Evidence& e);

struct FoundScale {
  Reading reading;
  std::string problem;
  double left = 0.0;  // what depth is off by with it, as a share
};
/// The factor of the poses' lengths that makes depth agree, where there is one.
std::optional<FoundScale> other_scale(Evidence& e);

}  // namespace rugae
