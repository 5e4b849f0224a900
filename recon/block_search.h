#pragma once
// A block of one picture compared with every place in reach in another.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace rugae {

/// Zero-mean normalised correlation (Lewis, Fast Normalized Cross-Correlation, Vision Interface
/// 1995) of square blocks with a picture (CV_8U), which goes on beyond its border in the middle
/// grey, 128. Sums of products are of whole numbers: exact.
class BlockSearch {
 public:
  /// Blocks of `side` px, at most kMostSide, may move by `reach` px each way.
  BlockSearch(const cv::Mat& picture, int side, int reach);
  static constexpr int kMostSide = 24;

  /// CV_32F, 2 reach + 1 px wide and high: the correlation of the block of `other`, a picture of
  /// the same size, that has its top left pixel at `corner`, with the picture where that pixel has
  /// moved by (column - reach, row - reach). Flat places and flat blocks correlate with nothing.
  cv::Mat operator()(const cv::Mat& other, const cv::Point& corner) const;

 private:
  const std::int16_t* levels(int x, int y) const {
    return levels_.data() + static_cast<std::ptrdiff_t>(y) * stride_ + x;
  }

  cv::Size size_;  // of the picture
  int side_, reach_, stride_;
  std::vector<std::int16_t> levels_;  // less 128, the border around them
  cv::Mat mean_, inverse_deviation_;  // CV_32F, of the block-sized place at each top left pixel
};

}  // namespace rugae
