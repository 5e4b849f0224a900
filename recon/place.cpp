// Tsai and Shah's relief of a mosaic, scaled and placed by the sparse points.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "recon/depth_field.h"
#include "recon/map.h"
#include "recon/masked_blur.h"
#include "recon/pinhole.h"

namespace rugae {
namespace {

constexpr std::size_t kMinPoints = 24;
/// Control points of the smooth part: about this many sparse points share one cell's area.
constexpr double kPointsPerCell = 4.0;
constexpr double kMinSpacingPx = 16.0, kMaxSpacingPx = 64.0;  // at 640 px width
/// Relief kept: smaller than the smooth part can follow, larger than single pixels.
constexpr double kReliefGrainPx = 1.5;  // standard deviation of the smoothing, at 640 px width
/// Slopes above this (62 degrees) from single pixels are noise of the linear approximation.
constexpr float kMaxReliefSlope = 2.0f;
/// Depth ends this many typical point distances away from the nearest point.
constexpr double kReachInSpacings = 2.5;
constexpr double kMinReachPx = 8.0, kMaxReachPx = 48.0;  // at 640 px width
/// Points nearer to the field than this share of their depth are never called wrong.
constexpr double kMinSpread = 1e-3;
/// A point the anchor itself saw is not behind a fold; others may be.
constexpr double kUnseenByAnchorWeight = 0.3;
/// A wall seen more obliquely than this (80 degrees) is a fold's edge bridged by the smooth part.
constexpr float kMinIncidenceCosine = 0.17f;

/// The relief's details between the grain and what the smooth part follows, px.
cv::Mat details(const cv::Mat& relief, const cv::Mat& valid, double grain_px, double spacing_px) {
  const cv::Mat fine = masked_blur(relief, valid, grain_px);
  cv::Mat band = fine - masked_blur(relief, valid, spacing_px);
  const float bound = kMaxReliefSlope * static_cast<float>(spacing_px);
  return cv::min(cv::max(band, -bound), bound);
}

struct SparsePoint {
  Vec2 pixel;  // of the mosaic
  double depth = 0.0;
  double weight = 1.0;
};

std::vector<SparsePoint> points_in(const Mosaic& mosaic, const Structure& structure,
                                   const Lens& lens) {
  std::vector<bool> member(structure.frames.size(), false);
  for (const int k : mosaic.members) member[k] = true;
  const Rigid3& anchor_from_world = structure.cam_from_world[mosaic.anchor];
  const LensProjector projector(lens);
  std::vector<SparsePoint> points;
  for (const Track& track : structure.tracks) {
    if (!track.triangulated) continue;
    bool seen = false, by_anchor = false;
    for (const Track::Observation& observation : track.observations) {
      seen = seen || member[observation.keyframe];
      by_anchor = by_anchor || observation.keyframe == mosaic.anchor;
    }
    if (!seen) continue;
    const Vec3 p_anchor = anchor_from_world * track.point;
    const auto on_anchor = projector.project(p_anchor);
    if (!on_anchor) continue;
    const Vec2 pixel = *on_anchor - mosaic.origin_px;
    const int x = static_cast<int>(std::floor(pixel.x()));
    const int y = static_cast<int>(std::floor(pixel.y()));
    if (x < 0 || y < 0 || x >= mosaic.valid.cols || y >= mosaic.valid.rows) continue;
    if (mosaic.valid.at<uchar>(y, x) == 0) continue;
    points.push_back({pixel, p_anchor.z(), by_anchor ? 1.0 : kUnseenByAnchorWeight});
  }
  return points;
}

/// Pixels farther than `reach_px` from every kept point.
cv::Mat out_of_reach(const std::vector<SparsePoint>& points, const std::vector<bool>& kept,
                     cv::Size size, double reach_px) {
  cv::Mat empty(size, CV_8U, cv::Scalar(255)), distance;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (kept[i])
      empty.at<uchar>(static_cast<int>(points[i].pixel.y()),
                      static_cast<int>(points[i].pixel.x())) = 0;
  cv::distanceTransform(empty, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distance > reach_px;
}

/// Clears depths where the surface through the neighbours is seen at a grazing angle, and what is
/// not a depth.
void drop_grazing(const Mosaic& mosaic, const Lens& lens, cv::Mat& depth) {
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  const LensProjector projector(lens);
  const bool pinhole = is_pinhole(lens);
  cv::Mat points(depth.size(), CV_32FC3, cv::Scalar::all(kUnknown));
  tbb::parallel_for(0, depth.rows, [&](int y) {
    for (int x = 0; x < depth.cols; ++x) {
      float& z = depth.at<float>(y, x);
      if (!(z > 0.0f)) {
        z = kUnknown;
        continue;
      }
      const Vec2 pixel = mosaic.origin_px + Vec2(x + 0.5, y + 0.5);
      Vec3 ray((pixel.x() - lens.cx) / lens.fx, (pixel.y() - lens.cy) / lens.fy, 1.0);
      if (!pinhole) {
        const auto bent = projector.unproject(pixel);
        if (bent) ray = *bent / bent->z();
        if (!bent) z = kUnknown;
      }
      const Vec3f p = (z * ray).cast<float>();
      points.at<cv::Vec3f>(y, x) = {p.x(), p.y(), p.z()};
    }
  });
  tbb::parallel_for(0, depth.rows - 1, [&](int y) {
    const auto at = [&](int row, int x) {
      const cv::Vec3f& p = points.at<cv::Vec3f>(row, x);
      return Vec3f(p[0], p[1], p[2]);
    };
    for (int x = 0; x + 1 < depth.cols; ++x) {
      const Vec3f centre = at(y, x);
      const Vec3f normal = (at(y, x + 1) - centre).cross(at(y + 1, x) - centre).normalized();
      const float cosine = std::abs(normal.dot(centre.normalized()));
      if (cosine < kMinIncidenceCosine) depth.at<float>(y, x) = kUnknown;  // not at the rim (NaN)
    }
  });
}

}  // namespace

// A relief in pixels under orthographic projection has slope p = dZ/dx = dz/dX. In a pinhole
// dX = z dx / f, so d(ln z)/dx = p / f: shading adds relief / f to the logarithm of depth. In the
// logarithm the fit also does not depend on the unit of length.
std::optional<MosaicDepth> place_mosaic(const Mosaic& mosaic, const Structure& structure,
                                        const Lens& lens, const ShadingOptions& options) {
  options.check();
  check(mosaic.bgr.type() == CV_8UC3 && mosaic.valid.type() == CV_8U &&
            mosaic.bgr.size() == mosaic.valid.size(),
        "place_mosaic: expected a CV_8UC3 picture and a CV_8U mask of its size");
  const std::vector<SparsePoint> points = points_in(mosaic, structure, lens);
  if (points.size() < kMinPoints) return std::nullopt;

  const double width_scale = lens.width / 640.0;
  const double area_px = cv::countNonZero(mosaic.valid);
  const double point_distance_px = std::sqrt(area_px / static_cast<double>(points.size()));
  const double spacing_px = std::clamp(std::sqrt(kPointsPerCell) * point_distance_px,
                                       kMinSpacingPx * width_scale, kMaxSpacingPx * width_scale);
  const double reach_px = std::clamp(kReachInSpacings * point_distance_px,
                                     kMinReachPx * width_scale, kMaxReachPx * width_scale);

  MosaicDepth placed;
  cv::Mat gray, intensity;
  cv::cvtColor(mosaic.bgr, gray, cv::COLOR_BGR2GRAY);
  gray.convertTo(intensity, CV_32F, 1.0 / 255.0);
  placed.light = estimate_light(intensity, mosaic.valid);
  const cv::Mat relief = details(tsai_shah(intensity, mosaic.valid, placed.light, options),
                                 mosaic.valid, kReliefGrainPx * width_scale, spacing_px) /
                         lens.fx;

  std::vector<FieldSample> samples;
  for (const SparsePoint& point : points) {
    const float ingredient =
        relief.at<float>(static_cast<int>(point.pixel.y()), static_cast<int>(point.pixel.x()));
    samples.push_back({point.pixel, std::log(point.depth), ingredient, point.weight});
  }
  const auto field = fit_depth_field(samples, mosaic.valid.size(), spacing_px, kMinSpread);
  if (!field) return std::nullopt;

  placed.depth = cv::Mat(mosaic.valid.size(), CV_32F);
  tbb::parallel_for(0, placed.depth.rows, [&](int y) {
    for (int x = 0; x < placed.depth.cols; ++x)
      placed.depth.at<float>(y, x) = static_cast<float>(
          std::exp(field->spline({x + 0.5, y + 0.5}) + field->scale * relief.at<float>(y, x)));
  });
  const float unknown = std::numeric_limits<float>::quiet_NaN();
  placed.depth.setTo(unknown, mosaic.valid == 0);
  placed.depth.setTo(unknown, out_of_reach(points, field->kept, placed.depth.size(), reach_px));
  drop_grazing(mosaic, lens, placed.depth);

  double square = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!field->kept[i]) {
      ++placed.rejected;
      continue;
    }
    const double error = points[i].depth * (1.0 - std::exp(-field->residuals[i]));
    square += error * error;
    ++placed.sparse_points;
  }
  if (placed.sparse_points == 0) return std::nullopt;
  placed.residual = std::sqrt(square / placed.sparse_points);
  placed.held_out = field->held_out;
  placed.relief_scale = field->scale;
  return placed;
}

}  // namespace rugae
