#pragma once
// The colour of the wall, not of the light on it.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/types.h"
#include "recon/dense/depth_map.h"

namespace rugae {

/// What a light at the camera's centre leaves of a frame's colours once its fall-off is undone:
///   albedo ~ L d^2 / cos(theta),
/// L the linear brightness, d the distance, theta the incidence. The frame is on the map's grid,
/// its levels sRGB; `gain` (CV_32F) undoes its vignetting. CV_32FC3, linear RGB, in the square of
/// the map's unit; NaN where there is no depth or no colour.
cv::Mat albedo_of(const WideFrame& frame, const cv::Mat& gain, const DepthMap& map);

/// Albedos times one gain, as sRGB in [0, 1]: how bright the light was nobody knows, so the
/// brightest are made to fill the range.
void to_display(std::vector<Vec3f>& albedos);

}  // namespace rugae
