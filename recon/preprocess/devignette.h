#pragma once
// Vignetting from the symmetry of radial gradients: Zheng, Yu, Kang, Lin, Kambhamettu,
// Single-image vignetting correction using radial gradient symmetry, CVPR 2008,
// doi:10.1109/CVPR.2008.4587413.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/types.h"

namespace rugae {

/// V(r) = exp(B(r)) in equal steps from the centre to `reach_px`; V(0) = 1.
struct VignettingProfile {
  Vec2 center_px = Vec2::Zero();
  double reach_px = 0.0;
  std::vector<double> v;

  /// Linear between the samples, the last value beyond reach_px.
  double at(double radius_px) const;
};

/// The profile that several images of one camera share. In a scene without a preferred direction
/// the radial gradients of ln I are symmetric about zero at every radius; vignetting shifts them by
/// d ln V / dr. `grays` are CV_8U of one size; `usable` (CV_8U, one an image, or empty) is 255
/// where a pixel may be used: pass what is neither a reflection nor outside the field. Too dark and
/// saturated pixels are left out. `reach_px` is where the profile ends, usually half the diagonal.
///
/// The intensities are used as they are stored: with a gamma curve I ~ L^(1/g), V is that of the
/// stored values and V^g that of the light. A light that moves with the camera makes the wall
/// darker where it is further off or slanted; what of this is common to all images and radial about
/// the centre goes into the profile as well and cannot be told from the lens' own.
VignettingProfile estimate_vignetting(const std::vector<cv::Mat>& grays,
                                      const std::vector<cv::Mat>& usable, const Vec2& center_px,
                                      double reach_px);

/// 1 / V at each pixel centre, CV_32F.
cv::Mat vignetting_gain(const VignettingProfile& profile, int width, int height);

/// `image` (CV_8U or CV_8UC3) times `gain`, rounded and saturated.
cv::Mat apply_gain(const cv::Mat& image, const cv::Mat& gain);

}  // namespace rugae
