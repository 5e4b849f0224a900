#include "dataset/label_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace rugae {

std::string depth_problem(const cv::Mat& depth_mm) {
  float least = std::numeric_limits<float>::infinity(), most = 0.0f;
  for (int y = 0; y < depth_mm.rows; ++y)
    for (int x = 0; x < depth_mm.cols; ++x) {
      const float z = depth_mm.at<float>(y, x);
      if (!(std::isfinite(z) && z > 0.0f)) continue;
      least = std::min(least, z);
      most = std::max(most, z);
    }
  if (most == 0.0f) return "no depth above 0 anywhere";
  if (least == most) return fmt::format("the depth is {:g} mm everywhere", most);
  return {};
}

std::optional<double> clamped_at_px(const cv::Mat& flow_px) {
  for (int axis = 0; axis < 2; ++axis) {
    float most = 0.0f;
    for (int y = 0; y < flow_px.rows; ++y)
      for (int x = 0; x < flow_px.cols; ++x)
        if (const float f = std::abs(flow_px.at<cv::Vec2f>(y, x)[axis]); std::isfinite(f))
          most = std::max(most, f);
    if (!(most > 0.0f)) continue;
    std::size_t at = 0, near = 0, below = 0;
    for (int y = 0; y < flow_px.rows; ++y)
      for (int x = 0; x < flow_px.cols; ++x) {
        const float f = std::abs(flow_px.at<cv::Vec2f>(y, x)[axis]);
        if (f == most)
          ++at;
        else if (f >= 0.9f * most)
          ++near;
        else if (std::isfinite(f))
          ++below;
      }
    // exact flow reaches its largest number once or twice
    constexpr std::size_t kMany = 16;
    if (at >= kMany && at >= near && below >= kMany) return most;
  }
  return std::nullopt;
}

}  // namespace rugae
