#include "dataset/warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace rugae {
namespace {

constexpr int kPatchesAcross = 24;
constexpr int kSpacingShare = 200;     // pixels of a patch are the image's width over this apart
constexpr double kSmoothDepth = 0.05;  // neighbours that differ by more are an edge
constexpr double kContrast = 1.5;      // least standard deviation of a textured patch, of 255

bool known(double depth_mm) { return std::isfinite(depth_mm) && depth_mm > 0.0; }

// The four pixels around a place and their weights; false at the border.
struct Around {
  int x = 0, y = 0;
  double u = 0.0, v = 0.0;
  bool inside = false;

  Around(const Vec2& pixel, const cv::Mat& image) {
    const double px = pixel.x() - 0.5, py = pixel.y() - 0.5;
    x = static_cast<int>(std::floor(px));
    y = static_cast<int>(std::floor(py));
    u = px - x;
    v = py - y;
    inside = x >= 0 && y >= 0 && x + 1 < image.cols && y + 1 < image.rows;
  }
  double mix(double a, double b, double c, double d) const {
    return (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d);
  }
};

// Not a number at the border, where a pixel has no depth, and across edges.
double smooth_depth_at(const cv::Mat& depth_mm, const Vec2& pixel) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Around at(pixel, depth_mm);
  if (!at.inside) return kNone;
  const float *upper = depth_mm.ptr<float>(at.y) + at.x,
              *lower = depth_mm.ptr<float>(at.y + 1) + at.x;
  const auto [least, most] = std::minmax({upper[0], upper[1], lower[0], lower[1]});
  if (!known(least) || !known(most) || !(most - least <= kSmoothDepth * least)) return kNone;
  return at.mix(upper[0], upper[1], lower[0], lower[1]);
}

double value_at(const cv::Mat& image, const Vec2& pixel) {
  const Around at(pixel, image);
  if (!at.inside) return std::numeric_limits<double>::quiet_NaN();
  const float *upper = image.ptr<float>(at.y) + at.x, *lower = image.ptr<float>(at.y + 1) + at.x;
  return at.mix(upper[0], upper[1], lower[0], lower[1]);
}

}  // namespace

WarpGrid::WarpGrid(const Lens& lens) : lens_(lens), projector_(lens) {
  const int step = std::max(1, lens.width / kPatchesAcross);
  const int spacing = std::max(1, lens.width / kSpacingShare);
  const int reach = spacing * (kAcross / 2);
  for (int cy = reach + step / 4; cy + reach < lens.height; cy += step)
    for (int cx = reach + step / 4; cx + reach < lens.width; cx += step) {
      Patch patch;
      bool whole = true;
      for (int k = 0; k < kAcross * kAcross && whole; ++k) {
        const int x = cx + spacing * (k % kAcross) - reach,
                  y = cy + spacing * (k / kAcross) - reach;
        const auto ray = projector_.unproject(Vec2(x + 0.5, y + 0.5));
        whole = ray && ray->z() > 0.0;
        if (whole) patch[k] = {x, y, *ray};
      }
      if (whole) patches_.push_back(patch);
    }
}

std::optional<Vec2> WarpGrid::lead(const Pixel& pixel, const cv::Mat& depth_mm,
                                   const Rigid3& other_from_this, DepthKind kind,
                                   double* z_mm) const {
  const double depth = depth_mm.at<float>(pixel.y, pixel.x);
  if (!known(depth)) return std::nullopt;
  const Vec3 p =
      other_from_this * (pixel.ray * (kind == DepthKind::z ? depth / pixel.ray.z() : depth));
  if (z_mm) *z_mm = kind == DepthKind::z ? p.z() : p.norm();
  const auto place = projector_.project(p);
  return place && lens_.contains(*place) ? place : std::nullopt;
}

WarpGrid::Landing WarpGrid::landing(const cv::Mat& depth_mm, const Rigid3& other_from_this) const {
  std::vector<double> moved_px;
  for (const Patch& patch : patches_) {
    const Pixel& at = centre(patch);
    if (const auto place = lead(at, depth_mm, other_from_this, DepthKind::z, nullptr))
      moved_px.push_back((*place - Vec2(at.x + 0.5, at.y + 0.5)).norm());
  }
  if (moved_px.empty()) return {};
  return {static_cast<double>(moved_px.size()) / static_cast<double>(patches_.size()),
          median_of(std::move(moved_px))};
}

std::vector<double> WarpGrid::depth_shares(const cv::Mat& depth_mm, const cv::Mat& other_depth_mm,
                                           const Rigid3& other_from_this, DepthKind kind) const {
  std::vector<double> shares;
  for (const Patch& patch : patches_) {
    double z_mm = 0.0;
    const auto place = lead(centre(patch), depth_mm, other_from_this, kind, &z_mm);
    if (!place) continue;
    const double found = smooth_depth_at(other_depth_mm, *place);
    if (!std::isnan(found)) shares.push_back(std::abs(found - z_mm) / z_mm);
  }
  return shares;
}

std::vector<double> WarpGrid::flow_errors_px(const cv::Mat& depth_mm, const cv::Mat& flow_px,
                                             const Rigid3& next_from_this, DepthKind kind) const {
  std::vector<double> errors;
  for (const Patch& patch : patches_) {
    const Pixel& at = centre(patch);
    const cv::Vec2f flow = flow_px.at<cv::Vec2f>(at.y, at.x);
    if (!std::isfinite(flow[0]) || !std::isfinite(flow[1])) continue;
    if (!known(depth_mm.at<float>(at.y, at.x))) continue;
    const auto place = lead(at, depth_mm, next_from_this, kind, nullptr);
    // known flow to a place that depth and pose do not lead to is as wrong as can be
    errors.push_back(place ? (*place - Vec2(at.x + 0.5 + flow[0], at.y + 0.5 + flow[1])).norm()
                           : std::numeric_limits<double>::infinity());
  }
  return errors;
}

std::vector<double> WarpGrid::colour_errors(const cv::Mat& image, const cv::Mat& depth_mm,
                                            const cv::Mat& other_image,
                                            const Rigid3& other_from_this, DepthKind kind) const {
  std::vector<double> errors;
  for (const Patch& patch : patches_) {
    double a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
    bool whole = true;
    for (const Pixel& at : patch) {
      const auto place = lead(at, depth_mm, other_from_this, kind, nullptr);
      const double there = place ? value_at(other_image, *place) : NAN;
      if (!(whole = !std::isnan(there))) break;
      const double here = image.at<float>(at.y, at.x);
      a += here, b += there, aa += here * here, bb += there * there, ab += here * there;
    }
    constexpr double kCount = kAcross * kAcross;
    const double vary_a = aa / kCount - a * a / (kCount * kCount);
    const double vary_b = bb / kCount - b * b / (kCount * kCount);
    if (!whole || !(vary_a >= kContrast * kContrast) || !(vary_b >= kContrast * kContrast))
      continue;
    const double together = ab / kCount - a * b / (kCount * kCount);
    errors.push_back(1.0 - together / std::sqrt(vary_a * vary_b));
  }
  return errors;
}

cv::Mat WarpGrid::smoothed(const cv::Mat& gray) {
  cv::Mat image;
  gray.convertTo(image, CV_32F);
  cv::GaussianBlur(image, image, cv::Size(), 1.0);
  return image;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return std::isnan(*middle) ? std::numeric_limits<double>::infinity() : *middle;
}

}  // namespace rugae
