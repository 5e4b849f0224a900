#pragma once
// What the numbers of one label say by themselves.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace rugae {

/// What is wrong with a depth image (CV_32F) by itself, or nothing: no value above 0, or one value
/// everywhere.
std::string depth_problem(const cv::Mat& depth_mm);

/// The size in px at which the flow (CV_32FC2) was cut off, if it was: many pixels hold that very
/// number, no fewer than lie in the tenth below it, and others are smaller.
std::optional<double> clamped_at_px(const cv::Mat& flow_px);

}  // namespace rugae
