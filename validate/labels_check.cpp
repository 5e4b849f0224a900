#include "validate/labels_check.h"

#include <cmath>
#include <limits>

#include "core/check.h"

namespace rugae {
namespace {

// Between pixel centres; NaN at the border and next to a pixel without depth.
double bilinear(const cv::Mat& image, const Vec2& pixel) {
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= image.cols || y0 + 1 >= image.rows)
    return std::numeric_limits<double>::quiet_NaN();
  const double u = x - x0, v = y - y0;
  return (1 - v) * ((1 - u) * image.at<float>(y0, x0) + u * image.at<float>(y0, x0 + 1)) +
         v * ((1 - u) * image.at<float>(y0 + 1, x0) + u * image.at<float>(y0 + 1, x0 + 1));
}

}  // namespace

LabelsCheck check_labels(const Lens& lens, const Rigid3& world_from_now,
                         const Rigid3& world_from_next, const FrameTruth& now,
                         const FrameTruth& next, int step) {
  check(step > 0, "check_labels: step is {}, expected above 0", step);
  check(!now.flow_px.empty() && now.flow_px.size() == now.depth_mm.size() &&
            now.depth_mm.size() == next.depth_mm.size(),
        "check_labels: the labels differ in size, or the first frame has no flow");
  const Rigid3 next_from_now = world_from_next.inverse() * world_from_now;
  const LensProjector projector(lens);
  LabelsCheck result;
  std::vector<double> flow_px, depth_share;
  for (int y = 0; y < now.depth_mm.rows; y += step)
    for (int x = 0; x < now.depth_mm.cols; x += step) {
      const unsigned char bits = now.masks.at<unsigned char>(y, x);
      if (!(bits & kMaskValid) || !(bits & kMaskFlowValid)) continue;
      ++result.pixels;
      const Vec2 pixel(x + 0.5, y + 0.5);
      const std::optional<Vec3> ray = projector.unproject(pixel);
      constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
      Vec3 p_next = Vec3::Constant(kNan);
      if (ray) p_next = next_from_now * (*ray * (now.depth_mm.at<float>(y, x) / ray->z()));
      const std::optional<Vec2> expected = projector.project(p_next);
      const cv::Vec2f flow = now.flow_px.at<cv::Vec2f>(y, x);
      const Vec2 led = pixel + Vec2(flow[0], flow[1]);
      flow_px.push_back(expected ? (led - *expected).norm() : kNan);  // valid flow must project
      if (!(bits & kMaskFlowOccluded)) {
        const double depth = bilinear(next.depth_mm, led);
        if (!std::isnan(depth)) depth_share.push_back(std::abs(depth - p_next.z()) / p_next.z());
      }
      if (now.normal.empty() || !ray) continue;
      const cv::Vec3f n = now.normal.at<cv::Vec3f>(y, x);
      const Vec3 normal(n[0], n[1], n[2]);
      constexpr double kUnit = 1e-2;  // normals may be stored in 8 bits a component
      if (std::abs(normal.norm() - 1.0) <= kUnit) ++result.unit_normals;
      if (normal.dot(*ray) <= kUnit) ++result.facing_normals;
    }
  result.flow_px = error_stats(flow_px);
  result.depth_share = error_stats(depth_share);
  return result;
}

}  // namespace rugae
