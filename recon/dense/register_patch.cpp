#include "recon/dense/register_patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/mask_at.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;
constexpr double kRadiusPx = 12.0;       // of the registration, at 640 px width
constexpr double kMaxMotionPx = 4.0;     // from its start, likewise
constexpr double kLeastRadiusPx = 7.0;   // of any picture: fewer pixels fix no place, as for tracks
constexpr double kLeastMotionPx = 2.5;   // likewise: their places are no nearer in pixels
constexpr double kMinCorrelation = 0.7;  // of what is then judged by consensus
constexpr int kTemplateHalfPx = 4;       // of the search, coarse
constexpr int kTemplateSide = 2 * kTemplateHalfPx + 1;
/// A coarse sieve: what passes must settle, and agree with the others.
constexpr double kMinSearchScore = 0.6;

PointRefinementOptions refinement_of(const Lens& lens) {
  const double scale = std::min(lens.width, kFineWidthPx) / kReferenceWidthPx;
  PointRefinementOptions options;
  options.radius_px = std::max(kLeastRadiusPx, kRadiusPx * scale);
  options.max_motion_px = std::max(kLeastMotionPx, kMaxMotionPx * scale);
  options.min_correlation = kMinCorrelation;
  return options;
}

// The anchor's coarse square as the frame sees it, around the point.
cv::Mat warped_template(const WallPatch& patch, const Mat2& linear) {
  const Mat2 back = linear.inverse();
  cv::Mat places(kTemplateSide, kTemplateSide, CV_32FC2), result;
  for (int y = 0; y < kTemplateSide; ++y)
    for (int x = 0; x < kTemplateSide; ++x) {
      const Vec2 at =
          patch.coarse_px + back * Vec2(x - kTemplateHalfPx, y - kTemplateHalfPx) - Vec2(0.5, 0.5);
      places.at<cv::Vec2f>(y, x) = {static_cast<float>(at.x()), static_cast<float>(at.y())};
    }
  cv::remap(patch.coarse, result, places, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return result;
}

// Where a parabola through a maximum and its neighbours peaks, from the maximum, in pixels.
double peak_offset(float before, float at, float after) {
  const double bend = static_cast<double>(before) - 2.0 * at + after;
  return bend < 0.0 ? 0.5 * (static_cast<double>(before) - after) / bend : 0.0;
}

}  // namespace

PatchRegistrar::PatchRegistrar(const Lens& lens) : refiner_(refinement_of(lens)) {}

std::optional<Vec2> PatchRegistrar::search(const WallPatch& patch, const PatchSight& sight,
                                           const PatchImage& image, double reach_px) const {
  if (patch.coarse.empty()) return std::nullopt;
  const Vec2 at = sight.pixel / image.coarse_shrink;
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  const int half = kTemplateHalfPx + static_cast<int>(std::ceil(reach_px / image.coarse_shrink));
  const cv::Rect window = cv::Rect(x - half, y - half, 2 * half + 1, 2 * half + 1) &
                          cv::Rect({0, 0}, image.coarse.size());
  if (window.width < kTemplateSide || window.height < kTemplateSide) return std::nullopt;
  cv::Mat scores;
  cv::matchTemplate(image.coarse(window), warped_template(patch, sight.linear), scores,
                    cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point place;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &place);
  if (!(best >= kMinSearchScore)) return std::nullopt;
  Vec2 middle(window.x + place.x + kTemplateHalfPx + 0.5,
              window.y + place.y + kTemplateHalfPx + 0.5);
  const auto score = [&](int dx, int dy) { return scores.at<float>(place.y + dy, place.x + dx); };
  if (place.x > 0 && place.x + 1 < scores.cols)
    middle.x() += peak_offset(score(-1, 0), score(0, 0), score(1, 0));
  if (place.y > 0 && place.y + 1 < scores.rows)
    middle.y() += peak_offset(score(0, -1), score(0, 0), score(0, 1));
  return middle * image.coarse_shrink;
}

std::optional<Vec2> PatchRegistrar::settle(const WallPatch& patch, const PatchSight& sight,
                                           const PatchImage& image, const Vec2& start) const {
  const auto place =
      refiner_(patch.fine, image.fine, patch.fine_px, start / image.fine_shrink, sight.linear);
  if (!place) return std::nullopt;
  const Vec2 pixel = *place * image.fine_shrink;
  return mask_at(image.usable, pixel) ? std::optional(pixel) : std::nullopt;
}

std::optional<Vec2> PatchRegistrar::find(const WallPatch& patch, const PatchSight& sight,
                                         const PatchImage& image, double reach_px) const {
  const auto start = search(patch, sight, image, reach_px);
  return start ? settle(patch, sight, image, *start) : std::nullopt;
}

}  // namespace rugae
