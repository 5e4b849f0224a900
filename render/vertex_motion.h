#pragma once
// Where the vertices of a mesh are around a moment.

#include <vector>

#include "core/types.h"

namespace rugae {

/// Time is counted in beats from the moment, -1 to 1: from `before` at -1 to `now` at 0 to `after`
/// at 1 every vertex moves on a straight line at constant speed. The lists must outlive the object.
struct VertexMotion {
  const std::vector<Vec3>* now = nullptr;
  const std::vector<Vec3>* before = nullptr;  // null, as `after`: the vertices keep still
  const std::vector<Vec3>* after = nullptr;

  bool moves() const { return before != nullptr; }
  Vec3 operator()(int vertex, double beat) const {
    const auto v = static_cast<std::size_t>(vertex);
    const Vec3& p = (*now)[v];
    if (!moves() || beat == 0.0) return p;
    return beat < 0.0 ? Vec3(p - beat * ((*before)[v] - p)) : Vec3(p + beat * ((*after)[v] - p));
  }
};

}  // namespace rugae
