#include "recon/dense/albedo.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/srgb.h"
#include "recon/dense/volume.h"

namespace rugae {
namespace {

/// Incidence beyond this says more of the normal's error than of the wall: 75 degrees.
constexpr double kMinCosine = 0.26;
/// At this level and above a pixel may be saturated.
constexpr float kSaturated = 250.0f;
constexpr double kBrightShare = 0.98;  // of the values are below `kBrightLinear`
constexpr double kBrightLinear = 0.8;

}  // namespace

cv::Mat albedo_of(const WideFrame& frame, const cv::Mat& gain, const DepthMap& map) {
  check(frame.bgr.type() == CV_32FC3 && frame.bgr.size() == map.depth.size() &&
            frame.known.size() == map.depth.size() && gain.size() == map.depth.size(),
        "albedo_of: frame, gain and depth map are not of one size");
  const cv::Mat slant = slant_of(map);
  cv::Mat albedo(map.depth.size(), CV_32FC3,
                 cv::Scalar::all(std::numeric_limits<float>::quiet_NaN()));
  for (int y = 0; y < albedo.rows; ++y)
    for (int x = 0; x < albedo.cols; ++x) {
      const auto& pixel = frame.bgr.at<cv::Vec3f>(y, x);
      if (frame.known.at<uchar>(y, x) == 0 ||
          std::max({pixel[0], pixel[1], pixel[2]}) >= kSaturated)
        continue;
      const double ray = map.grid.ray(x, y).norm();
      const double cosine = slant.at<float>(y, x) / ray;
      if (!(cosine >= kMinCosine)) continue;
      const double distance = map.depth.at<float>(y, x) * ray;
      const double light = cosine / (distance * distance);
      for (int c = 0; c < 3; ++c)
        albedo.at<cv::Vec3f>(y, x)[c] = static_cast<float>(
            linear_from_srgb(gain.at<float>(y, x) * pixel[2 - c] / 255.0) / light);
    }
  return albedo;
}

void to_display(std::vector<Vec3f>& albedos) {
  std::vector<float> values;
  for (const Vec3f& albedo : albedos)
    if (albedo.maxCoeff() > 0.0f) values.push_back(albedo.maxCoeff());
  if (values.empty()) return;
  const auto bright = values.begin() + static_cast<std::ptrdiff_t>(
                                           kBrightShare * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), bright, values.end());
  const double gain = kBrightLinear / *bright;
  for (Vec3f& albedo : albedos)
    for (int c = 0; c < 3; ++c)
      albedo[c] = static_cast<float>(srgb_from_linear(std::clamp(gain * albedo[c], 0.0, 1.0)));
}

}  // namespace rugae
