#pragma once
// Specular reflections: found by shape and appearance together, and painted over.

#include <opencv2/core/mat.hpp>

#include "recon/options.h"

namespace rugae {

/// 255 where a reflection was detected, 0 elsewhere. `gray` is CV_8U as it came from the camera
/// (before undistortion). Shape: the magnitude of the gradient, closed morphologically so that the
/// flat inside of a highlight is filled from its steep rim, is at least its own mean plus standard
/// deviation. Appearance: I >= mean + standard deviation of I. Both must hold.
///
/// The paper states the threshold on I only; the same adaptive rule is used on the closed map. The
/// appearance mask alone also takes every part of the wall close to the light. Where `field`
/// (CV_8U; empty: everywhere) is 0 a field stop keeps the light out: neither the black there nor
/// its edge counts.
cv::Mat detect_reflections(const cv::Mat& gray, const ReflectionOptions& options,
                           const cv::Mat& field = {});

/// `image` (CV_8U or CV_8UC3) with the marked pixels inpainted: Telea 2004,
/// doi:10.1080/10867651.2004.10487596, or Bertalmio et al. 2001 (Navier-Stokes),
/// doi:10.1109/CVPR.2001.990497.
cv::Mat suppress_reflections(const cv::Mat& image, const cv::Mat& reflection,
                             const ReflectionOptions& options);

}  // namespace rugae
