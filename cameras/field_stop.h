#pragma once
// The stop that bounds what a capsule's sensor sees: outside it no light arrives.

#include <string>

#include "core/types.h"

namespace rugae {

enum class StopShape { full, circle, octagon };

struct FieldStop {
  StopShape shape = StopShape::full;
  /// Of the circle, or of the regular octagon's inscribed circle (two sides level), as a share of
  /// half the image's smaller side.
  double radius = 1.0;

  /// True where light passes; `offset_px` from the principal point, `unit_px` half the image's
  /// smaller side.
  bool passes(const Vec2& offset_px, double unit_px) const;
  /// Throws Error naming `place`.
  void check(const std::string& place) const;
};

}  // namespace rugae
