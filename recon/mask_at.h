#pragma once
// A mask at a place between pixels.

#include <opencv2/core/mat.hpp>

#include "core/types.h"

namespace rugae {

/// `mask`: CV_8U; `pixel` in (0.5, 0.5) convention. False outside.
inline bool mask_at(const cv::Mat& mask, const Vec2& pixel) {
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < mask.cols && pixel.y() < mask.rows &&
         mask.at<unsigned char>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x())) != 0;
}

}  // namespace rugae
