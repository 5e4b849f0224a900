#include "recon/dense/consistency.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace rugae {
namespace {

constexpr int kOverlapStride = 16;    // pixels looked at, each way
constexpr double kMinOverlap = 0.05;  // of the depths looked at
/// Depths of one wall seen by two maps differ by less than this, whatever their sigma.
constexpr double kOverlapShare = 0.1;

/// What a map has where it sees a point, from the nearest pixel.
struct Seen {
  double z = 0.0;  // of the point
  double depth = std::numeric_limits<double>::quiet_NaN(), sigma = 0.0;
};

/// Another map, and where it sees points of the first one.
class OtherMap {
 public:
  OtherMap(const DepthMap& other, const DepthMap& first) : map_(other) {
    const Rigid3 other_from_first = other.cam_from_world * first.cam_from_world.inverse();
    rotation_ = other_from_first.rotation.toRotationMatrix();
    translation_ = other_from_first.translation;
  }

  Seen seen(const Vec3& p_first) const {
    const Vec3 p = rotation_ * p_first + translation_;
    Seen seen{p.z()};
    if (!(p.z() > 0.0)) return seen;
    const Vec2 pixel = map_.grid.project(p);
    if (!map_.grid.contains(pixel)) return seen;
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    seen.depth = map_.depth.at<float>(y, x);
    seen.sigma = map_.sigma.at<float>(y, x);
    return seen;
  }

 private:
  const DepthMap& map_;
  Mat3 rotation_;
  Vec3 translation_;
};

double squared(double v) { return v * v; }

}  // namespace

cv::Mat agreeing_maps(const DepthMap& map, const std::vector<const DepthMap*>& others,
                      double sigmas) {
  cv::Mat agreeing(map.depth.size(), CV_8U, cv::Scalar(0));
  std::vector<OtherMap> other_maps;
  for (const DepthMap* other : others) other_maps.emplace_back(*other, map);
  for (int y = 0; y < map.grid.height; ++y)
    for (int x = 0; x < map.grid.width; ++x) {
      const double z = map.depth.at<float>(y, x), sigma = map.sigma.at<float>(y, x);
      if (!(z > 0.0)) continue;
      const Vec3 p = z * map.grid.ray(x, y);
      for (const OtherMap& other : other_maps) {
        const Seen seen = other.seen(p);
        const double variance = squared(sigma) + squared(seen.sigma);
        if (squared(seen.depth - seen.z) <= squared(sigmas) * variance) ++agreeing.at<uchar>(y, x);
      }
    }
  return agreeing;
}

void keep_agreed(DepthMap& map, const cv::Mat& agreeing, int least, int smallest_px) {
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  cv::Mat gone = agreeing < least, labels, stats, centres;
  const cv::Mat known = ~gone & (map.depth > 0.0f);
  const int islands = cv::connectedComponentsWithStats(known, labels, stats, centres, 4, CV_32S);
  std::vector<bool> small(static_cast<std::size_t>(islands), false);
  for (int i = 1; i < islands; ++i) small[i] = stats.at<int>(i, cv::CC_STAT_AREA) < smallest_px;
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x)
      if (small[labels.at<int>(y, x)]) gone.at<uchar>(y, x) = 255;
  map.depth.setTo(kUnknown, gone);
  map.sigma.setTo(kUnknown, gone);
}

std::vector<std::vector<int>> overlapping_maps(const std::vector<DepthMap>& maps, int most) {
  std::vector<std::vector<int>> overlapping(maps.size());
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t i) {
    const DepthMap& map = maps[i];
    std::vector<Vec3> points;
    for (int y = kOverlapStride / 2; y < map.grid.height; y += kOverlapStride)
      for (int x = kOverlapStride / 2; x < map.grid.width; x += kOverlapStride)
        if (const double z = map.depth.at<float>(y, x); z > 0.0)
          points.push_back(z * map.grid.ray(x, y));
    std::vector<std::pair<int, int>> found;  // minus the number of points, the map
    for (std::size_t j = 0; j < maps.size(); ++j) {
      if (j == i) continue;
      const OtherMap other(maps[j], map);
      int count = 0;
      for (const Vec3& p : points) {
        const Seen seen = other.seen(p);
        count += std::abs(seen.depth - seen.z) <= kOverlapShare * seen.z ? 1 : 0;
      }
      if (count > 0 && count >= kMinOverlap * static_cast<double>(points.size()))
        found.emplace_back(-count, static_cast<int>(j));
    }
    std::ranges::sort(found);
    for (const auto& [count, j] : found)
      if (static_cast<int>(overlapping[i].size()) < most) overlapping[i].push_back(j);
  });
  return overlapping;
}

}  // namespace rugae
