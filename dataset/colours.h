#pragma once
// Labels and errors as pictures for people.

#include <opencv2/core/mat.hpp>
#include <string>

#include "core/types.h"

namespace rugae {

/// Values from `low` to `high` as inferno colours, low bright; NaN dark gray. CV_8UC3, BGR.
cv::Mat depth_picture(const cv::Mat& depth, double low, double high);

/// Normals in camera axes as colours: red to the right, green up, blue towards the camera.
cv::Mat normal_picture(const cv::Mat& normal);

/// Flow as colours: the hue is the direction, the strength of the colour the length up to
/// `longest_px`; gray where there is none.
cv::Mat flow_picture(const cv::Mat& flow_px, double longest_px);
/// The key to flow_picture: a disc whose rim is `longest_px` away.
cv::Mat flow_wheel(int side_px);

/// The frame, darkened, with its mask bits in the colours of `mask_key_html`.
cv::Mat mask_picture(const cv::Mat& bgr, const cv::Mat& masks);
std::string mask_key_html();

/// Numbers told apart: each its own colour, 0 and NaN dark gray. CV_8U, or the first channel of
/// float. CV_8UC3, BGR.
cv::Mat number_picture(const cv::Mat& numbers);

/// Error colours from teal (none) over cream to dark red (`t` = 1); sRGB in [0, 1].
Vec3f error_colour(double t);
/// The same colours as a CSS gradient, from left to right.
std::string error_gradient_css();
std::string depth_gradient_css();

/// The value below which a share of the finite pixels lie; NaN when there are none.
double quantile(const cv::Mat& image, double share);

}  // namespace rugae
