#pragma once
// The free space as a bent tube: places are named by how far along its axis they are and how far
// beside it.

#include <vector>

#include "trajectories/free_space.h"

namespace rugae {

/// An axis with a frame that turns as little as possible, and for every place along it and every
/// direction around it how far the space is free. Every point the tube gives keeps the distance
/// `keep_mm` from the wall at the stations where it was measured.
class Tube {
 public:
  /// `axis`: points at equal steps of length (at least 8).
  Tube(const FreeSpace& space, const std::vector<Vec3>& axis, double keep_mm);

  double length_mm() const { return length_mm_; }
  /// The point `along_mm` in [0, length] along the axis and (x, y) mm beside it, drawn in smoothly
  /// where that would leave the free space: for any x and y the point is inside.
  Vec3 point(double along_mm, const Vec2& beside_mm) const;
  /// Free distance from the axis in direction `angle_rad` around it, mm.
  double extent_mm(double along_mm, double angle_rad) const;
  /// Columns: the two directions across (x, y) and the direction along the axis.
  Quat frame(double along_mm) const;

 private:
  double parameter(double along_mm) const;
  double raw_extent(int station, int azimuth) const {
    return extents_[station * kAzimuths + azimuth];
  }

  static constexpr int kAzimuths = 32;
  double length_mm_ = 0.0;
  std::vector<Vec3> axis_;       // spline control points
  std::vector<Quat> frames_;     // spline control rotations
  std::vector<double> extents_;  // spline control values, stations x azimuths
};

}  // namespace rugae
