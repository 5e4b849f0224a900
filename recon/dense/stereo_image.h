#pragma once
// Frames as the correlation compares them: brightness relative to its neighbourhood.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "recon/dense/wide_frames.h"

namespace rugae {

/// One level of a frame.
struct StereoImage {
  PinholeGrid grid;
  /// CV_32F: brightness over the mean around it, minus one; NaN where a reflection was or nothing
  /// is seen. The light moves with the camera: its fall-off over a window, which would pull on the
  /// correlation, is in the mean, and so are vignetting and gain.
  cv::Mat texture;
};

/// Levels of a frame for windows of `radius_px`, the finest, that of `grid`, first, each half as
/// wide as the one before.
std::vector<StereoImage> stereo_levels(const WideFrame& frame, const PinholeGrid& grid, int levels,
                                       int radius_px);

}  // namespace rugae
