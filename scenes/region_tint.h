#pragma once
// How the colour of the mucosa changes from region to region: smooth over centimetres, read from a
// grid in the space of rest positions.

#include <functional>
#include <vector>

#include "core/float4.h"
#include "scenes/scene.h"

namespace rugae {

class RegionTint {
 public:
  /// `region_at` is asked at the nodes of a grid over `box`, from several threads.
  RegionTint(const Eigen::AlignedBox3d& box, const std::function<Region(const Vec3&)>& region_at);

  /// Factors on red, green and blue of the body's albedo, and how well submucosal vessels show
  /// through (0 to 1). Outside the box: what its nearest face has.
  Float4x4 fetch(const Float4x3& rest_position_mm) const;

 private:
  Vec3f origin_;
  Vec3i size_;
  std::vector<float> nodes_;  // four a node, x fastest
};

}  // namespace rugae
