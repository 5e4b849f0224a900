#pragma once
// Zero-mean normalised correlation of two pictures' windows, by sums that slide down and across,
// four places of the picture at once.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/float4.h"

namespace rugae {

/// A picture (CV_32F) cut into four upright strips that lie on one another, CV_32FC4: channel k of
/// column x is the picture's column k * width_of_strips + x. What slides along a row does so in all
/// strips at once. NaN where the last strip has no picture.
cv::Mat strips_of(const cv::Mat& picture);

/// Rows of two pictures' strips at the same height; NaN where a picture knows nothing.
struct RowPair {
  const float* reference = nullptr;
  const float* other = nullptr;
};

constexpr int kWindowSums = 6;  // of 1, a, b, a^2, b^2, a b

class WindowCorrelation {
 public:
  /// Windows of 2 * radius_px + 1 pixels each way.
  WindowCorrelation(int width_of_strips, int radius_px);

  /// Before the first row of a pair of pictures.
  void reset();
  /// Takes one row in and another out; `nowhere()` where the picture has none.
  void slide(const RowPair& in, const RowPair& out);
  RowPair nowhere() const { return {unknown_.data(), unknown_.data()}; }
  /// Correlation of the windows over the rows that are in, a row of strips; NaN where fewer than
  /// 60 % of the window are known of both.
  void correlate(float* scores);

 private:
  /// Over a window or its part.
  struct Sums {
    Float4 of[kWindowSums];
  };

  int width_, radius_;
  std::vector<float> unknown_;
  std::vector<Sums> columns_;  // of each strip, and of what is left and right of it
};

/// Mean of the better half of the known values of each place, at least two of them; NaN with fewer.
/// `rows` of strips: one for each source, up to 64.
void better_half(const std::vector<const float*>& rows, int width_of_strips, float* means);

}  // namespace rugae
