#pragma once
// The start of a structure: the relative pose of two key frames.

#include <optional>
#include <vector>

#include "core/rigid3.h"

namespace rugae {

struct TwoView {
  Rigid3 second_from_first;  // |translation| is 1
  std::vector<char> inlier;  // of each correspondence
  std::vector<Vec3> points;  // of each correspondence, in the first camera; NaN for outliers
  int inliers = 0;
  double median_parallax_rad = 0.0;  // of the inliers
  bool planar = false;               // came from a homography
};

/// Relative pose from corresponding rays (x/z, y/z), up to scale: the essential matrix by the
/// five-point method within RANSAC (Nister, TPAMI 2004, doi:10.1109/TPAMI.2004.17) and, for the
/// case that the wall is flat, the decomposition of the homography (Malis and Vargas, INRIA
/// RR-6303, 2007). Every candidate is refined on its points; the one that explains most
/// correspondences to `threshold_px` at that focal length wins. Empty with fewer than 8
/// correspondences or inliers.
std::optional<TwoView> two_view(const std::vector<Vec2>& first, const std::vector<Vec2>& second,
                                double focal_px, double threshold_px);

}  // namespace rugae
