// What the sparse points say of a key frame's depth.

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "recon/dense/depth_map.h"
#include "recon/depth_field.h"

namespace rugae {
namespace {

constexpr std::size_t kMinPoints = 24;
/// Control points of the surface: about this many points share one cell's area.
constexpr double kPointsPerCell = 4.0;
constexpr double kMinSpacing = 1.0 / 40.0, kMaxSpacing = 1.0 / 10.0;  // of the width
constexpr double kMinSpreadLn = 1e-3;
/// The wall strays from the surface by as much as these shares of the points do, and then some:
/// points are few on folds that stand out.
constexpr double kStrayShare = 0.02;
constexpr double kStrayFactor = 1.5;
constexpr double kMinReachLn = 0.15, kMaxReachLn = 0.6;
/// The surface is held between the points' depths, give or take this.
constexpr double kBeyondPointsLn = 0.3;

}  // namespace

std::vector<SparseDepth> sparse_depths(const Structure& structure, int keyframe,
                                       const PinholeGrid& grid) {
  std::vector<SparseDepth> depths;
  for (const Track& track : structure.tracks) {
    if (!track.triangulated) continue;
    const bool seen = std::ranges::any_of(
        track.observations, [&](const auto& o) { return o.keyframe == keyframe && o.inlier; });
    if (!seen) continue;
    const Vec3 p_cam = structure.cam_from_world[keyframe] * track.point;
    if (!(p_cam.z() > 0.0)) continue;
    const Vec2 pixel = grid.project(p_cam);
    if (grid.contains(pixel)) depths.push_back({pixel, p_cam.z()});
  }
  return depths;
}

DepthPrior depth_prior(const Structure& structure, int keyframe, const PinholeGrid& grid) {
  std::vector<FieldSample> samples;
  for (const SparseDepth& point : sparse_depths(structure, keyframe, grid))
    samples.push_back({point.pixel, std::log(point.z), 0.0, 1.0});
  if (samples.size() < kMinPoints) return {};
  const double area_px = static_cast<double>(grid.width) * grid.height;
  const double spacing_px =
      std::clamp(std::sqrt(kPointsPerCell * area_px / static_cast<double>(samples.size())),
                 kMinSpacing * grid.width, kMaxSpacing * grid.width);
  const auto field = fit_depth_field(samples, grid.size(), spacing_px, kMinSpreadLn);
  if (!field) return {};

  std::vector<double> values, strays;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    values.push_back(samples[i].value);
    strays.push_back(std::abs(field->residuals[i]));
  }
  std::ranges::sort(values);
  std::ranges::sort(strays);
  const auto skipped = static_cast<std::size_t>(kStrayShare * static_cast<double>(values.size()));
  const double nearest = values[skipped] - kBeyondPointsLn;
  const double farthest = values[values.size() - 1 - skipped] + kBeyondPointsLn;
  DepthPrior prior;
  prior.reach_ln =
      std::clamp(kStrayFactor * strays[strays.size() - 1 - skipped], kMinReachLn, kMaxReachLn);
  prior.depth = cv::Mat(grid.size(), CV_32F);
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x)
      prior.depth.at<float>(y, x) = static_cast<float>(
          std::exp(std::clamp(field->spline({x + 0.5, y + 0.5}), nearest, farthest)));
  return prior;
}

}  // namespace rugae
