#pragma once
// How far along its path the capsule is at each moment.

#include <cstdint>
#include <vector>

#include "trajectories/trajectory.h"

namespace rugae {

/// share of the path = integral of the speed, speed = base + (peak - base) sum_k bump_k. The bumps
/// are cos^2 lobes that do not overlap, so that mean 1 and the wanted peak fix the base.
class TimeLaw {
 public:
  TimeLaw(const PaceOptions& pace, std::uint64_t seed);
  /// Share of the path's length, in [0, 1], covered at `fraction` of the duration; its derivative
  /// is continuous.
  double share(double fraction) const;

 private:
  double base_ = 1.0, peak_ = 1.0, width_ = 0.0;
  std::vector<double> centers_;
};

}  // namespace rugae
