#include "recon/dense/register_patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "recon/dense/search_square.h"
#include "recon/mask_at.h"

namespace rugae {
namespace {

/// A coarse sieve: what passes must settle, and agree with the others.
constexpr double kMinSearchScore = 0.6;

// The anchor's coarse square as the frame sees it, around the point; its edge goes on.
SearchSquare warped_square(const WallPatch& patch, const Mat2& linear) {
  const Mat2 back = linear.inverse();
  const int last = patch.coarse.cols - 1;
  SearchSquare square;
  std::size_t i = 0;
  for (int y = -kSearchHalfPx; y <= kSearchHalfPx; ++y)
    for (int x = -kSearchHalfPx; x <= kSearchHalfPx; ++x, ++i) {
      const Vec2 at = (patch.coarse_px + back * Vec2(x, y) - Vec2(0.5, 0.5))
                          .cwiseMax(0.0)
                          .cwiseMin(static_cast<double>(last));
      const int ix = std::min(static_cast<int>(at.x()), last - 1),
                iy = std::min(static_cast<int>(at.y()), last - 1);
      const double fx = at.x() - ix, fy = at.y() - iy;
      const unsigned char* p0 = patch.coarse.ptr<unsigned char>(iy) + ix;
      const unsigned char* p1 = patch.coarse.ptr<unsigned char>(iy + 1) + ix;
      square[i] = static_cast<float>((1 - fy) * ((1 - fx) * p0[0] + fx * p0[1]) +
                                     fy * ((1 - fx) * p1[0] + fx * p1[1]));
    }
  return square;
}

}  // namespace

PatchRegistrar::PatchRegistrar(const Lens& lens) : refiner_(patch_refinement(lens)) {}

std::optional<Vec2> PatchRegistrar::search(const WallPatch& patch, const PatchSight& sight,
                                           const PatchImage& image, double reach_px) const {
  if (patch.coarse.empty()) return std::nullopt;
  const Vec2 at = sight.pixel / image.coarse_shrink;
  const int half = kSearchHalfPx + static_cast<int>(std::ceil(reach_px / image.coarse_shrink));
  const cv::Rect window(static_cast<int>(std::floor(at.x())) - half,
                        static_cast<int>(std::floor(at.y())) - half, 2 * half + 1, 2 * half + 1);
  const auto hit = search_square(warped_square(patch, sight.linear), image.coarse, window);
  if (!hit || !(hit->correlation >= kMinSearchScore)) return std::nullopt;
  return hit->centre_px * image.coarse_shrink;
}

std::optional<Vec2> PatchRegistrar::settle(const WallPatch& patch, const PatchSight& sight,
                                           const PatchImage& image, const Vec2& start) const {
  const auto place = refiner_(patch.fine, image.fine, start / image.fine_shrink, sight.linear);
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
