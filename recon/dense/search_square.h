#pragma once
// A small square of one picture looked for in a window of another.

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/types.h"

namespace rugae {

constexpr int kSearchHalfPx = 4;
constexpr int kSearchSidePx = 2 * kSearchHalfPx + 1;
/// Grey levels, row by row.
using SearchSquare = std::array<float, kSearchSidePx * kSearchSidePx>;

struct SearchHit {
  Vec2 centre_px;  // of the square, (0.5, 0.5) convention, to a fraction by a parabola
  double correlation = 0.0;
};

/// Where the square's zero-mean normalised correlation with the picture (CV_8U) is highest, of all
/// whole places at which it lies in the window and in the picture; the first of equal ones. Places
/// as good as flat correlate with nothing. Empty where the square has no place or no texture.
std::optional<SearchHit> search_square(const SearchSquare& square, const cv::Mat& picture,
                                       const cv::Rect& window);

}  // namespace rugae
