#include "recon/dense/search_square.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/float4.h"

namespace rugae {
namespace {

constexpr int kLanes = 4;
constexpr float kPixels = kSearchSidePx * kSearchSidePx;
// 8-bit levels less this are whole numbers whose sums of squares a float holds exactly.
constexpr float kMiddle = 128.0F;
constexpr float kFlatLevels = 0.5F;  // standard deviation: rounding to 8 bits makes as much

// The window as floats, its rows filled up so that every group of four can be read.
struct Levels {
  int width, height, stride;
  std::vector<float> values;

  Levels(const cv::Mat& picture, const cv::Rect& window)
      : width(window.width),
        height(window.height),
        stride(window.width + 2 * kLanes),
        values(static_cast<std::size_t>(stride) * window.height, 0.0F) {
    for (int y = 0; y < height; ++y) {
      const auto* from = picture.ptr<unsigned char>(window.y + y) + window.x;
      std::transform(from, from + width, values.begin() + static_cast<std::ptrdiff_t>(y) * stride,
                     [](unsigned char level) { return static_cast<float>(level) - kMiddle; });
    }
  }
  const float* row(int y) const { return values.data() + static_cast<std::ptrdiff_t>(y) * stride; }
};

// Sums of the square's height of rows, of levels and of their squares, column by column.
class ColumnSums {
 public:
  explicit ColumnSums(const Levels& levels)
      : levels_(levels), sum_(levels.stride), squares_(levels.stride) {
    for (int y = 0; y < kSearchSidePx; ++y)
      for (int x = 0; x < levels.width; ++x) add(x, levels.row(y)[x], 1.0F);
  }
  /// From the rows from `top` on to those from top + 1 on.
  void descend(int top) {
    const float *out = levels_.row(top), *in = levels_.row(top + kSearchSidePx);
    for (int x = 0; x < levels_.width; ++x) {
      add(x, out[x], -1.0F);
      add(x, in[x], 1.0F);
    }
  }
  /// Squared deviations from their mean in the squares that begin at x, x + 1, x + 2 and x + 3.
  Float4 variation(int x) const {
    Float4 sum = _mm_setzero_ps(), squares = sum;
    for (int i = 0; i < kSearchSidePx; ++i) {
      sum = sum + _mm_loadu_ps(&sum_[static_cast<std::size_t>(x + i)]);
      squares = squares + _mm_loadu_ps(&squares_[static_cast<std::size_t>(x + i)]);
    }
    return squares - sum * sum * splat(1.0F / kPixels);
  }

 private:
  void add(int x, float level, float sign) {
    sum_[static_cast<std::size_t>(x)] += sign * level;
    squares_[static_cast<std::size_t>(x)] += sign * level * level;
  }

  const Levels& levels_;
  std::vector<float> sum_, squares_;
};

// The square's values times those of the squares that begin at p, p + 1, p + 2 and p + 3.
Float4 products(const SearchSquare& square, const float* p, int stride) {
  Float4 even = _mm_setzero_ps(), odd = even;  // two sums, so that one need not wait for the other
  const float* s = square.data();
  for (int y = 0; y < kSearchSidePx; ++y, p += stride, s += kSearchSidePx) {
    for (int x = 0; x + 1 < kSearchSidePx; x += 2) {
      even = even + splat(s[x]) * _mm_loadu_ps(p + x);
      odd = odd + splat(s[x + 1]) * _mm_loadu_ps(p + x + 1);
    }
    even = even + splat(s[kSearchSidePx - 1]) * _mm_loadu_ps(p + kSearchSidePx - 1);
  }
  return even + odd;
}

// Where the parabola through a maximum, the middle of `at(y, x)`, and the eight around it peaks,
// from the maximum, in pixels: derivatives by differences, the mixed one too, for the ridges of a
// wall's pattern are slanted.
Vec2 peak_offset(const Mat3& at) {
  const double x_slope = 0.5 * (at(1, 2) - at(1, 0)), y_slope = 0.5 * (at(2, 1) - at(0, 1));
  const double xx = at(1, 2) - 2.0 * at(1, 1) + at(1, 0), yy = at(2, 1) - 2.0 * at(1, 1) + at(0, 1);
  const double xy = 0.25 * (at(2, 2) - at(0, 2) - at(2, 0) + at(0, 0));
  const double determinant = xx * yy - xy * xy;
  if (!(xx < 0.0 && determinant > 0.0)) return Vec2::Zero();
  const Vec2 offset = Vec2(xy * y_slope - yy * x_slope, xy * x_slope - xx * y_slope) / determinant;
  // Further off, it is not this parabola's.
  return offset.cwiseAbs().maxCoeff() <= 1.0 ? offset : Vec2(Vec2::Zero());
}

}  // namespace

std::optional<SearchHit> search_square(const SearchSquare& square, const cv::Mat& picture,
                                       const cv::Rect& around) {
  const cv::Rect window = around & cv::Rect({0, 0}, picture.size());
  const int columns = window.width - kSearchSidePx + 1, rows = window.height - kSearchSidePx + 1;
  if (columns < 1 || rows < 1) return std::nullopt;
  SearchSquare sought = square;
  double mean = 0.0, squares = 0.0;
  for (const float value : square) mean += value / kPixels;
  for (float& value : sought) {
    value -= static_cast<float>(mean);
    squares += static_cast<double>(value) * value;
  }
  constexpr float kFlat = kPixels * kFlatLevels * kFlatLevels;
  if (!(squares > kFlat)) return std::nullopt;

  const Levels levels(picture, window);
  ColumnSums sums(levels);
  const int stride = (columns + kLanes - 1) / kLanes * kLanes;
  std::vector<float> scores(static_cast<std::size_t>(stride) * rows);
  const auto score = [&](int x, int y) -> float& {
    return scores[static_cast<std::size_t>(y) * stride + x];
  };
  int best_x = 0, best_y = 0;
  for (int y = 0; y < rows; ++y) {
    if (y > 0) sums.descend(y - 1);
    for (int x = 0; x < columns; x += kLanes) {
      const Float4 variation = sums.variation(x);
      const Float4 correlation = products(sought, levels.row(y) + x, levels.stride) /
                                 root(variation * splat(static_cast<float>(squares)));
      _mm_storeu_ps(&score(x, y), _mm_and_ps(above(variation, splat(kFlat)), correlation));
    }
    const int x =
        static_cast<int>(std::max_element(&score(0, y), &score(0, y) + columns) - &score(0, y));
    if (score(x, y) > score(best_x, best_y)) best_x = x, best_y = y;
  }
  SearchHit hit{Vec2(best_x, best_y), score(best_x, best_y)};
  if (best_x > 0 && best_x + 1 < columns && best_y > 0 && best_y + 1 < rows) {
    Mat3 nine;
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 3; ++x) nine(y, x) = score(best_x + x - 1, best_y + y - 1);
    hit.centre_px += peak_offset(nine);
  }
  hit.centre_px += Vec2(window.x + kSearchHalfPx + 0.5, window.y + kSearchHalfPx + 0.5);
  return hit;
}

}  // namespace rugae
