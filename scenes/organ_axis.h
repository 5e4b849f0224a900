#pragma once
// The axis of a hollow organ with its calibre: a chain of overlapping balls. It gives the smooth
// shape of the procedural stomach, and to any wall the coordinates along and around the organ that
// the folds follow.

#include <vector>

#include "core/types.h"

namespace rugae {

struct AxisNode {
  Vec3 centre;  // mm
  double radius_mm = 0.0;
};

/// Where a point is, seen from the axis. Lengths in mm.
struct AxisPoint {
  double distance_mm = 0.0;  // to the smooth envelope of the balls, negative inside
  Vec3 gradient = Vec3::Zero();
  double s_mm = 0.0;         // along the axis, from the first node
  double greater_mm = 0.0;   // across, towards the greater curvature
  double side_mm = 0.0;      // across, at right angles to it
  double cos_greater = 0.0;  // 1 on the greater curvature, -1 on the lesser
  // The axis' own directions there: along it, towards the greater curvature, and to the side.
  Vec3 along = Vec3::Zero(), greater = Vec3::Zero(), side = Vec3::Zero();
};

class OrganAxis {
 public:
  /// A Catmull-Rom spline through the nodes is sampled by balls every `step_mm` or less, joined
  /// with `softness_mm` (the width over which neighbours blend). Distances in y count 1/`depth`
  /// times (depth 0.9: sections flattened to 90 % from front to back). The greater curvature is
  /// found at every ball across the axis and across `pole`: tangent x pole.
  OrganAxis(const std::vector<AxisNode>& nodes, double step_mm, double softness_mm, double depth,
            const Vec3& pole);

  AxisPoint locate(const Vec3& p) const;
  /// The distance alone, and its gradient where one is asked for: cheaper than locate.
  double distance_mm(const Vec3& p, Vec3* gradient = nullptr) const;
  double length_mm() const { return balls_.back().s_mm; }
  /// Arc length of the given node.
  double node_s_mm(std::size_t node) const { return node_s_mm_[node]; }
  /// Unit direction from the axis' beginning to the point at that share of its length.
  Vec3 direction_to(double share) const;
  Eigen::AlignedBox3d box() const;

 private:
  struct Ball {
    Vec3 centre, greater, side;
    double radius_mm, s_mm;
  };
  // The same centres (y over depth) and radii by pairs, for two lanes at once; an odd one is joined
  // by a ball far away.
  struct Pair {
    double x[2], y[2], z[2], radius[2];
  };
  struct Weights;
  double weigh(const Vec3& p, Weights& weights) const;

  std::vector<Ball> balls_;
  std::vector<Pair> pairs_;
  std::vector<double> node_s_mm_;
  double softness_mm_, depth_, log_overlap_;
};

}  // namespace rugae
