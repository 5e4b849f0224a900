#pragma once
// Masks a bit a pixel, for those that are held by the thousand.

#include <opencv2/core/mat.hpp>

namespace rugae {

/// Of a mask (CV_8U, 0 or 255): CV_8U, eight pixels a byte, the first in the lowest bit. Throws
/// Error for another type.
cv::Mat packed_mask(const cv::Mat& mask);
/// The mask again, `cols` wide.
cv::Mat unpacked_mask(const cv::Mat& packed, int cols);

}  // namespace rugae
