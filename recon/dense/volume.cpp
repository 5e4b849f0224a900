#include "recon/dense/volume.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>

#include "core/check.h"

namespace rugae {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
/// Distances are trusted to this many voxels on either side of the wall.
constexpr double kTruncationVoxels = 4.0;
/// Pixels to either side whose points give the normal.
constexpr int kNormalReachPx = 2;
constexpr float kMinIncidenceCosine = 0.17f;  // 80 degrees
/// Blocks and voxels are numbered from the middle, each way; 21 bits each.
constexpr int kKeyBits = 21, kKeyOrigin = 1 << (kKeyBits - 1);

/// Difference of the points to either side, or to the one that is known; zero where none is.
Vec3 difference(const DepthMap& map, int x, int y, int dx, int dy) {
  const auto point = [&](int px, int py) -> std::optional<Vec3> {
    if (px < 0 || py < 0 || px >= map.grid.width || py >= map.grid.height) return std::nullopt;
    const double z = map.depth.at<float>(py, px);
    if (!(z > 0.0)) return std::nullopt;
    return z * map.grid.ray(px, py);
  };
  const auto here = point(x, y), after = point(x + dx, y + dy), before = point(x - dx, y - dy);
  if (after && before) return *after - *before;
  if (after) return *after - *here;
  if (before) return *here - *before;
  return Vec3::Zero();
}

}  // namespace

cv::Mat slant_of(const DepthMap& map) {
  cv::Mat slant(map.depth.size(), CV_32F, cv::Scalar(kUnknown));
  for (int y = 0; y < map.grid.height; ++y)
    for (int x = 0; x < map.grid.width; ++x) {
      if (!(map.depth.at<float>(y, x) > 0.0f)) continue;
      const Vec3 normal =
          difference(map, x, y, kNormalReachPx, 0).cross(difference(map, x, y, 0, kNormalReachPx));
      const double length = normal.norm();
      if (length > 0.0)
        slant.at<float>(y, x) =
            static_cast<float>(std::abs(normal.dot(map.grid.ray(x, y))) / length);
    }
  return slant;
}

/// A depth map ready to be looked up.
struct DistanceVolume::View {
  const DepthMap& map;
  const cv::Mat& colours;
  cv::Mat slant;   // CV_32F; NaN: not to be used
  cv::Mat weight;  // CV_32F, voxel^2 / sigma^2 along the normal

  View(const DepthMap& depth_map, const cv::Mat& pixel_colours, double voxel)
      : map(depth_map),
        colours(pixel_colours),
        slant(slant_of(depth_map)),
        weight(depth_map.depth.size(), CV_32F, cv::Scalar(0.0)) {
    for (int y = 0; y < map.grid.height; ++y)
      for (int x = 0; x < map.grid.width; ++x) {
        float& s = slant.at<float>(y, x);
        const double sigma = map.sigma.at<float>(y, x) * s;
        if (!(s >= kMinIncidenceCosine * map.grid.ray(x, y).norm() && sigma > 0.0))
          s = kUnknown;
        else
          weight.at<float>(y, x) = static_cast<float>(voxel * voxel / (sigma * sigma));
      }
  }

  bool known(int x, int y) const { return std::isfinite(slant.at<float>(y, x)); }

  /// Depth between the pixels where the four around belong to one wall, else the nearest one's.
  float depth_at(const Vec2& pixel, int x, int y, float wall) const {
    const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
    const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
    const float nearest = map.depth.at<float>(y, x);
    if (left < 0 || top < 0 || left + 1 >= map.grid.width || top + 1 >= map.grid.height)
      return nearest;
    const float *p = map.depth.ptr<float>(top) + left, *q = map.depth.ptr<float>(top + 1) + left;
    const auto near = [&](float z) { return std::abs(z - nearest) <= wall; };
    if (!(near(p[0]) && near(p[1]) && near(q[0]) && near(q[1]))) return nearest;
    const auto across = static_cast<float>(u - left), down = static_cast<float>(v - top);
    const float upper = p[0] + across * (p[1] - p[0]), lower = q[0] + across * (q[1] - q[0]);
    return upper + down * (lower - upper);
  }
};

DistanceVolume::DistanceVolume(double voxel) : voxel_(voxel) {
  check(voxel > 0.0 && std::isfinite(voxel), "DistanceVolume: a voxel's side is {}", voxel);
}

std::uint64_t DistanceVolume::key_of(const Vec3i& place) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis)
    key = key << kKeyBits | static_cast<std::uint64_t>(place[axis] + kKeyOrigin);
  return key;
}

Vec3i DistanceVolume::block_of(std::uint64_t key) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kKeyBits) - 1;
  return {static_cast<int>(key >> (2 * kKeyBits)) - kKeyOrigin,
          static_cast<int>(key >> kKeyBits & kMask) - kKeyOrigin,
          static_cast<int>(key & kMask) - kKeyOrigin};
}

std::vector<std::uint64_t> DistanceVolume::touched_blocks(const View& view) const {
  const PinholeGrid& grid = view.map.grid;
  const Rigid3 world_from_cam = view.map.cam_from_world.inverse();
  std::vector<std::vector<std::uint64_t>> of_rows(static_cast<std::size_t>(grid.height));
  tbb::parallel_for(0, grid.height, [&](int y) {
    std::vector<std::uint64_t>& keys = of_rows[y];
    for (int x = 0; x < grid.width; ++x) {
      if (!view.known(x, y)) continue;
      const Vec3 ray = grid.ray(x, y);
      const Vec3 wall = view.map.depth.at<float>(y, x) * ray;
      const double slant = view.slant.at<float>(y, x);
      for (int step = -static_cast<int>(kTruncationVoxels); step <= kTruncationVoxels; ++step) {
        const Vec3 p = (world_from_cam * (wall + step * voxel_ / slant * ray)) / (kSide * voxel_);
        const Vec3i block = p.array().floor().cast<int>();
        if (block.cwiseAbs().maxCoeff() >= kKeyOrigin / kSide - 1) continue;
        const std::uint64_t key = key_of(block);
        if (keys.empty() || keys.back() != key) keys.push_back(key);
      }
    }
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  });
  std::vector<std::uint64_t> all;
  for (const auto& keys : of_rows) all.insert(all.end(), keys.begin(), keys.end());
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

void DistanceVolume::update(const View& view, std::uint64_t key, Block& block) const {
  const PinholeGrid& grid = view.map.grid;
  const Vec3i origin = kSide * block_of(key);
  std::size_t i = 0;
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x, ++i) {
        const Vec3 p_cam =
            view.map.cam_from_world * (voxel_ * (origin + Vec3i(x, y, z)).cast<double>());
        if (!(p_cam.z() > 0.0)) continue;
        const Vec2 pixel = grid.project(p_cam);
        if (!grid.contains(pixel)) continue;
        const int px = static_cast<int>(pixel.x()), py = static_cast<int>(pixel.y());
        if (!view.known(px, py)) continue;
        const double slant = view.slant.at<float>(py, px);
        const auto wall = static_cast<float>(kTruncationVoxels * voxel_ / slant);
        const double along = view.depth_at(pixel, px, py, wall) - p_cam.z();
        const double distance = along * slant / voxel_;
        if (!(distance >= -kTruncationVoxels)) continue;  // behind the wall nothing is known
        Voxel& voxel = block[i];
        const float weight = view.weight.at<float>(py, px);
        const auto held = static_cast<float>(std::min(distance, kTruncationVoxels));
        voxel.weight += weight;
        voxel.roots += std::sqrt(weight);
        voxel.distance += weight / voxel.weight * (held - voxel.distance);
        if (view.colours.empty()) continue;
        const auto& colour = view.colours.at<cv::Vec3f>(py, px);
        if (!(colour[0] == colour[0])) continue;
        voxel.colour_weight += weight;
        for (int c = 0; c < 3; ++c)
          voxel.colour[c] += weight / voxel.colour_weight * (colour[c] - voxel.colour[c]);
      }
}

void DistanceVolume::integrate(const DepthMap& map, const cv::Mat& colours) {
  check(map.depth.size() == map.grid.size() && map.sigma.size() == map.depth.size() &&
            (colours.empty() || (colours.size() == map.depth.size() && colours.type() == CV_32FC3)),
        "DistanceVolume: depth, sigma and colours are not of one size");
  const View view(map, colours, voxel_);
  const std::vector<std::uint64_t> keys = touched_blocks(view);
  std::vector<Block*> blocks;
  for (const std::uint64_t key : keys) {
    const auto [place, fresh] = index_.try_emplace(key, blocks_.size());
    if (fresh) blocks_.push_back(std::make_unique<Block>());
    blocks.push_back(blocks_[place->second].get());
  }
  tbb::parallel_for(std::size_t{0}, keys.size(),
                    [&](std::size_t i) { update(view, keys[i], *blocks[i]); });
}

}  // namespace rugae
