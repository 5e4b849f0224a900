#pragma once
// SURF by dlib, whose headers stay in one file.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/types.h"

namespace rugae {

struct SurfPoint {
  Vec2 pixel;                     // (0.5, 0.5) convention
  std::vector<float> descriptor;  // 64 numbers
};

/// The strongest points of a CV_8U image (Bay et al. 2006, doi:10.1007/11744023_32).
std::vector<SurfPoint> surf_points(const cv::Mat& gray, int max_points);

}  // namespace rugae
