#pragma once
// A point from the rays of the cameras that see it.

#include <optional>
#include <vector>

#include "core/rigid3.h"

namespace rugae {

/// One camera's sight of the point.
struct Sight {
  Rigid3 cam_from_world;
  Vec2 ray;  // (x/z, y/z)
};

/// Largest angle, rad, between any two of the rays from the camera centres to the point.
double parallax_rad(const std::vector<Sight>& sights, const Vec3& point);

/// The point nearest to all lines of sight, then Gauss-Newton on the re-projection error. Empty
/// when the point comes to lie behind a camera or the system is singular.
std::optional<Vec3> triangulate(const std::vector<Sight>& sights);

struct RobustPoint {
  Vec3 point;
  std::vector<char> inlier;  // of each sight
  int inliers = 0;
};

/// The same when some sights may be wrong: the pair of sights that most others agree with to
/// `threshold` (in the units of `ray`) starts it, and all that agree finish it. Empty when fewer
/// than two agree or the parallax of those that do is below `min_parallax_rad`. Pairs are taken in
/// order of their distance in the list, widest first, a fixed number at most: nothing is drawn.
std::optional<RobustPoint> triangulate_robust(const std::vector<Sight>& sights, double threshold,
                                              double min_parallax_rad);

}  // namespace rugae
