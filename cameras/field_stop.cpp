#include "cameras/field_stop.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace rugae {

// Octagon: the four pairs of parallel sides lie at the inscribed radius in x, in y and along both
// diagonals.
bool FieldStop::passes(const Vec2& offset_px, double unit_px) const {
  const double reach_px = radius * unit_px;
  const double x = std::abs(offset_px.x()), y = std::abs(offset_px.y());
  switch (shape) {
    case StopShape::full:
      return true;
    case StopShape::circle:
      return x * x + y * y <= reach_px * reach_px;
    case StopShape::octagon:
      return std::max({x, y, (x + y) * std::sqrt(0.5)}) <= reach_px;
  }
  return false;
}

void FieldStop::check(const std::string& place) const {
  rugae::check(radius >= 0.1 && radius <= 2.0, "{}: field_stop_radius is {}, expected 0.1 to 2",
               place, radius);
}

}  // namespace rugae
