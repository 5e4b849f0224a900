#pragma once
// Images moved from one lens' pixel grid to another's, by our own lens model.

#include <opencv2/core/mat.hpp>

#include "cameras/camera.h"

namespace rugae {

/// A map between the grids, computed once. Interpolation is OpenCV's remap, whose coordinates are
/// exact to 1/64 px (it tabulates 1/32 px steps).
class Undistortion {
 public:
  Undistortion(const Lens& from, const Lens& to);

  /// `image` on the target grid, cubic interpolation; black where there is no original pixel.
  cv::Mat image(const cv::Mat& image) const;
  /// A mask (0 or 255) on the target grid: set where at least half of the pixel is set.
  cv::Mat mask(const cv::Mat& mask) const;
  /// CV_8U, 255 where the target pixel has an original pixel with all its neighbours.
  const cv::Mat& valid() const { return valid_; }

 private:
  // OpenCV's integer-centre convention, as its remap wants it: whole px (CV_16SC2) and 1/32 px
  // steps (CV_16U), which it would otherwise find anew for each image.
  cv::Mat source_px_, source_step_;
  cv::Mat valid_;
};

}  // namespace rugae
