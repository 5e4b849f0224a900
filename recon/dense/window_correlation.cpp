#include "recon/dense/window_correlation.h"

#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>

#include "core/check.h"

namespace rugae {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
/// This share of a window must be seen by both.
constexpr float kMinSeen = 0.6f;
/// Contrast below which texture is rounding and noise, assumed: half a grey level of a hundred,
/// averaged over the four pixels of a frame that a pixel here is made of.
constexpr float kNoiseContrast = 0.0025f;
constexpr std::size_t kMaxSources = 64;  // twice what DenseOptions::views may be
constexpr float kBelowAll = -2.0f;       // scores go from -1 to 1

/// What each sum gets from one place; 0 where one of both is unknown.
struct Products {
  Products(const RowPair& rows, int x) {
    const Float4 r = _mm_loadu_ps(rows.reference + 4 * x), o = _mm_loadu_ps(rows.other + 4 * x);
    const Float4 both = _mm_cmpord_ps(r, o);
    const Float4 a = _mm_and_ps(both, r), b = _mm_and_ps(both, o);
    const Float4 products[] = {_mm_and_ps(both, splat(1.0f)), a, b, a * a, b * b, a * b};
    std::ranges::copy(products, of);
  }
  Float4 of[kWindowSums];
};

Float4 next_strips(Float4 v) {
  return _mm_castsi128_ps(_mm_srli_si128(_mm_castps_si128(v), sizeof(float)));
}
Float4 strips_before(Float4 v) {
  return _mm_castsi128_ps(_mm_slli_si128(_mm_castps_si128(v), sizeof(float)));
}

}  // namespace

cv::Mat strips_of(const cv::Mat& picture) {
  const int width = (picture.cols + 3) / 4;
  cv::Mat strips(picture.rows, width, CV_32FC4, cv::Scalar::all(kUnknown));
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      strips.at<cv::Vec4f>(y, x % width)[x / width] = picture.at<float>(y, x);
  return strips;
}

WindowCorrelation::WindowCorrelation(int width_of_strips, int radius_px)
    : width_(width_of_strips), radius_(radius_px) {
  unknown_.assign(4 * static_cast<std::size_t>(width_), kUnknown);
  columns_.resize(static_cast<std::size_t>(width_ + 2 * radius_));
  reset();
}

void WindowCorrelation::reset() {
  Sums none;
  std::ranges::fill(none.of, _mm_setzero_ps());
  std::ranges::fill(columns_, none);
}

void WindowCorrelation::slide(const RowPair& in, const RowPair& out) {
  for (int x = 0; x < width_; ++x) {
    const Products more(in, x), less(out, x);
    Sums& column = columns_[x + radius_];
    for (int i = 0; i < kWindowSums; ++i) column.of[i] = column.of[i] + more.of[i] - less.of[i];
  }
}

void WindowCorrelation::correlate(float* scores) {
  for (int x = 0; x < radius_; ++x)  // outwards: a strip's width farther out is one strip more
    for (int i = 0; i < kWindowSums; ++i) {
      const int left = radius_ - 1 - x, right = radius_ + width_ + x;
      columns_[left].of[i] = strips_before(columns_[left + width_].of[i]);
      columns_[right].of[i] = next_strips(columns_[right - width_].of[i]);
    }
  Sums sums;
  std::ranges::fill(sums.of, _mm_setzero_ps());
  const auto add = [&](const Sums& column) {
    for (int i = 0; i < kWindowSums; ++i) sums.of[i] = sums.of[i] + column.of[i];
  };
  for (int x = 0; x < 2 * radius_; ++x) add(columns_[x]);
  const int side = 2 * radius_ + 1;
  const Float4 least = splat(kMinSeen * static_cast<float>(side * side));
  const Float4 noise = splat(kNoiseContrast * kNoiseContrast), zero = _mm_setzero_ps();
  for (int x = 0; x < width_; ++x) {
    add(columns_[x + 2 * radius_]);
    const auto& [n, a, b, a2, b2, ab] = sums.of;
    const Float4 inverse = splat(1.0f) / n;
    const Float4 aa = max(a2 - a * a * inverse, zero) + noise * n;
    const Float4 bb = max(b2 - b * b * inverse, zero) + noise * n;
    const Float4 score = (ab - a * b * inverse) / root(aa * bb);
    _mm_storeu_ps(scores + 4 * x, select(_mm_cmpge_ps(n, least), score, splat(kUnknown)));
    for (int i = 0; i < kWindowSums; ++i) sums.of[i] = sums.of[i] - columns_[x].of[i];
  }
}

void better_half(const std::vector<const float*>& rows, int width_of_strips, float* means) {
  const std::size_t count = rows.size();
  check(count <= kMaxSources, "better_half: {} sources, at most {}", count, kMaxSources);
  Float4 best[kMaxSources];  // the highest first, those unknown last
  for (int x = 0; x < width_of_strips; ++x) {
    Float4 known = _mm_setzero_ps();
    for (std::size_t i = 0; i < count; ++i) {
      const Float4 score = _mm_loadu_ps(rows[i] + 4 * x), is_known = _mm_cmpord_ps(score, score);
      known = known + _mm_and_ps(is_known, splat(1.0f));
      Float4 rest = select(is_known, score, splat(kBelowAll));
      for (std::size_t j = 0; j < i; ++j) {
        const Float4 higher = max(best[j], rest);
        rest = min(best[j], rest);
        best[j] = higher;
      }
      best[i] = rest;
    }
    // Half of them, an odd one counted in.
    const Float4 half =
        max(splat(2.0f), _mm_cvtepi32_ps(_mm_cvttps_epi32((known + splat(1.0f)) * splat(0.5f))));
    Float4 sum = _mm_setzero_ps();
    for (std::size_t i = 0; i < count; ++i)
      sum = sum + _mm_and_ps(_mm_cmplt_ps(splat(static_cast<float>(i)), half), best[i]);
    _mm_storeu_ps(means + 4 * x,
                  select(_mm_cmpge_ps(known, splat(2.0f)), sum / half, splat(kUnknown)));
  }
}

}  // namespace rugae
