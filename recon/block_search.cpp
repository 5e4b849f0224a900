#include "recon/block_search.h"

#include <emmintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"

namespace rugae {
namespace {

constexpr int kLanes = 8;  // levels in a register
constexpr int kGroups = BlockSearch::kMostSide / kLanes;
constexpr int kAtOnce = 4;  // places
constexpr int kMiddle = 128;
constexpr double kFlatLevels = 0.5;  // standard deviation: rounding to 8 bits makes as much

// The block's levels less 128, rows filled up with zeros.
using Block = std::array<std::int16_t, BlockSearch::kMostSide * BlockSearch::kMostSide>;

// The sums of products with the levels at p, p + 1, p + 2 and p + 3.
__m128i products(const Block& block, int side, const std::int16_t* p, int stride) {
  const __m128i zero = _mm_setzero_si128();
  __m128i sum[kAtOnce] = {zero, zero, zero, zero};
  for (int y = 0; y < side; ++y, p += stride)
    for (int group = 0; group < kGroups; ++group) {
      const __m128i mine = _mm_loadu_si128(
          reinterpret_cast<const __m128i*>(&block[y * BlockSearch::kMostSide + group * kLanes]));
      for (int place = 0; place < kAtOnce; ++place)
        sum[place] = _mm_add_epi32(
            sum[place], _mm_madd_epi16(mine, _mm_loadu_si128(reinterpret_cast<const __m128i*>(
                                                 p + group * kLanes + place))));
    }
  const __m128i even = _mm_add_epi32(_mm_unpacklo_epi32(sum[0], sum[2]),
                                     _mm_unpackhi_epi32(sum[0], sum[2]));  // 0, 2, 0, 2
  const __m128i odd = _mm_add_epi32(_mm_unpacklo_epi32(sum[1], sum[3]),
                                    _mm_unpackhi_epi32(sum[1], sum[3]));  // 1, 3, 1, 3
  return _mm_add_epi32(_mm_unpacklo_epi32(even, odd), _mm_unpackhi_epi32(even, odd));
}

}  // namespace

BlockSearch::BlockSearch(const cv::Mat& picture, int side, int reach)
    : size_(picture.size()), side_(side), reach_(reach) {
  check(picture.type() == CV_8U && side > 0 && side <= kMostSide && reach >= 0 &&
            side <= picture.cols && side <= picture.rows,
        "block search: expected an 8-bit picture and blocks of 1 to {} px in it, found type {}, {} "
        "x {}, {} px",
        kMostSide, picture.type(), picture.cols, picture.rows, side);
  cv::Mat wide, sum, squares;
  cv::copyMakeBorder(picture, wide, reach, reach, reach, reach, cv::BORDER_CONSTANT,
                     cv::Scalar(kMiddle));
  // Beyond the last place every group of registers can still be read.
  stride_ = wide.cols + kMostSide + kAtOnce;
  levels_.assign(static_cast<std::size_t>(stride_) * wide.rows, 0);
  for (int y = 0; y < wide.rows; ++y) {
    const auto* from = wide.ptr<unsigned char>(y);
    auto* to = &levels_[static_cast<std::size_t>(y) * stride_];
    for (int x = 0; x < wide.cols; ++x) to[x] = static_cast<std::int16_t>(from[x] - kMiddle);
  }
  cv::integral(wide, sum, squares, CV_32S, CV_64F);
  mean_.create(wide.rows - side + 1, wide.cols - side + 1, CV_32F);
  inverse_deviation_.create(mean_.size(), CV_32F);
  const double pixels = static_cast<double>(side) * side;
  const auto inside = [&](const auto& totals, int x, int y) {
    return totals(y + side, x + side) - totals(y + side, x) - totals(y, x + side) + totals(y, x);
  };
  const cv::Mat_<int> sums(sum);
  const cv::Mat_<double> sums_of_squares(squares);
  for (int y = 0; y < mean_.rows; ++y)
    for (int x = 0; x < mean_.cols; ++x) {
      const double mean = inside(sums, x, y) / pixels;
      const double variation = inside(sums_of_squares, x, y) - mean * mean * pixels;
      mean_.at<float>(y, x) = static_cast<float>(mean - kMiddle);
      inverse_deviation_.at<float>(y, x) = static_cast<float>(
          variation > pixels * kFlatLevels * kFlatLevels ? 1.0 / std::sqrt(variation) : 0.0);
    }
}

cv::Mat BlockSearch::operator()(const cv::Mat& other, const cv::Point& corner) const {
  check(other.type() == CV_8U && other.size() == size_,
        "block search: expected an 8-bit picture of {} x {}, found type {}, {} x {}", size_.width,
        size_.height, other.type(), other.cols, other.rows);
  check(corner.x >= 0 && corner.y >= 0 && corner.x + side_ <= size_.width &&
            corner.y + side_ <= size_.height,
        "block search: the block of {} px at ({}, {}) leaves the picture of {} x {}", side_,
        corner.x, corner.y, size_.width, size_.height);
  Block block{};
  int sum = 0, squares = 0;
  for (int y = 0; y < side_; ++y)
    for (int x = 0; x < side_; ++x) {
      const int level = other.at<unsigned char>(corner.y + y, corner.x + x) - kMiddle;
      block[y * kMostSide + x] = static_cast<std::int16_t>(level);
      sum += level;
      squares += level * level;
    }
  const int places = 2 * reach_ + 1;
  cv::Mat scores = cv::Mat::zeros(places, places, CV_32F);
  const double pixels = static_cast<double>(side_) * side_;
  const double variation = squares - static_cast<double>(sum) * sum / pixels;
  if (!(variation > pixels * kFlatLevels * kFlatLevels)) return scores;
  const auto inverse = static_cast<float>(1.0 / std::sqrt(variation));
  const auto total = static_cast<float>(sum);
  for (int y = 0; y < places; ++y) {
    auto* row = scores.ptr<float>(y);
    const float* mean = mean_.ptr<float>(corner.y + y) + corner.x;
    const float* deviation = inverse_deviation_.ptr<float>(corner.y + y) + corner.x;
    for (int x = 0; x < places; x += kAtOnce) {
      std::int32_t products_at[kAtOnce];
      _mm_storeu_si128(reinterpret_cast<__m128i*>(products_at),
                       products(block, side_, levels(corner.x + x, corner.y + y), stride_));
      for (int i = x; i < std::min(x + kAtOnce, places); ++i)
        row[i] =
            (static_cast<float>(products_at[i - x]) - total * mean[i]) * deviation[i] * inverse;
    }
  }
  return scores;
}

}  // namespace rugae
