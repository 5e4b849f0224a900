#pragma once
// Depth maps against one another.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "recon/dense/depth_map.h"

namespace rugae {

/// CV_8U: in how many of the others the same place of the wall is found within `sigmas` joint
/// standard deviations.
cv::Mat agreeing_maps(const DepthMap& map, const std::vector<const DepthMap*>& others,
                      double sigmas);

/// Clears depths that fewer than `least` others agree with, then islands of fewer than
/// `smallest_px` pixels.
void keep_agreed(DepthMap& map, const cv::Mat& agreeing, int least, int smallest_px);

/// For each depth map, the others that look at the same wall: those that most of its depths fall
/// into, at most `most`.
std::vector<std::vector<int>> overlapping_maps(const std::vector<DepthMap>& maps, int most);

}  // namespace rugae
