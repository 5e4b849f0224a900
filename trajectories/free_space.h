#pragma once
// The room inside a closed wall: how far from the wall a place is, and the medial line from one end
// to the other.

#include <vector>

#include "core/mesh.h"

namespace rugae {

/// Distances to the wall on a regular grid, in mm, positive inside; the wall itself is asked where
/// accuracy matters.
class FreeSpace {
 public:
  /// The mesh must outlive the object. Work is spread over threads; the result does not depend on
  /// their number.
  explicit FreeSpace(const TriangleMesh& wall);

  /// Exact distance to the wall, mm; negative outside.
  double depth_mm(const Vec3& p) const { return -wall_.signed_distance_mm(p); }
  /// The unit direction away from the closest point of the wall, inward; zero on the wall.
  Vec3 away_from_wall(const Vec3& p) const;

  /// The roomiest grid point.
  Vec3 widest_point() const;
  double widest_mm() const;

  /// The way from one end to the other through the largest connected part of the space deeper than
  /// `depth_mm`, along the medial axis: `count` >= 8 points at equal steps, smooth. Ends are the
  /// two places of that part that are farthest apart inside it. Fewer than 8 grid points in that
  /// part: the line shrinks to (nearly) the widest point.
  std::vector<Vec3> medial_line(double depth_mm, int count) const;

 private:
  Vec3 point(int index) const;

  ClosestPoint wall_;
  Vec3 origin_;
  double step_mm_ = 1.0;
  Vec3i size_;
  std::vector<double> depth_mm_;
};

/// `count` points at equal steps of length along a polyline.
std::vector<Vec3> resample(const std::vector<Vec3>& line, int count);

}  // namespace rugae
