#pragma once
// What a camera's lights alone make of a frame.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "cameras/camera.h"
#include "studies/tone_curve.h"

namespace rugae {

/// Light that a wall of one colour sends to the camera, sum over the lights of E cos(i) with the
/// irradiance E of cameras/emitter.h and the angle i between normal and light (Lambert), in units
/// of an emitter's intensity over mm^2: no highlights, no shadows, no fall-off of the lens. CV_32F
/// of the size of `depth_mm` (CV_32F, along z) and `normal` (CV_32FC3, unit, camera axes, facing
/// the camera); 0 where depth is unknown.
cv::Mat light_alone(const cv::Mat& depth_mm, const cv::Mat& normal, const Lens& lens,
                    const std::vector<Emitter>& lights);

/// `light` as a picture (CV_8U) by the tone curve, exposed so that through the lens it would be as
/// bright as `gray`: the medians of light times `through` (CV_32F, the lens' V) and of the light
/// that `gray` stores are the same, over the pixels where `gray` is neither dark nor saturated.
/// Empty where there is no such pixel, or no light there.
cv::Mat picture_of_light(const cv::Mat& light, const cv::Mat& through, const cv::Mat& gray,
                         const ToneCurve& tone);

}  // namespace rugae
