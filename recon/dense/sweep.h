#pragma once
// Correlation of a view with others along surfaces of one shape, nearer and farther.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/rigid3.h"
#include "recon/dense/stereo_image.h"

namespace rugae {

struct SweepSource {
  const StereoImage* image = nullptr;
  Rigid3 source_from_reference;
};

/// What the sweep looks at: the surface z(pixel) exp(step_ln * k), k = -reach ... reach.
struct SweepRange {
  double step_ln = 0.0;
  int reach = 0;
  int count() const { return 2 * reach + 1; }
};

/// The scores of all pixels: `count` in a row for each pixel, row by row.
struct ScoreVolume {
  cv::Size size;
  int count = 0;
  std::vector<float> scores;  // -1 ... 1, NaN: fewer than two sources see the place

  float* at(int x, int y) {
    return &scores[(static_cast<std::size_t>(y) * size.width + x) * count];
  }
  const float* at(int x, int y) const {
    return &scores[(static_cast<std::size_t>(y) * size.width + x) * count];
  }
};

/// How many pixels a place on the surface moves in the source for a change of ln depth by one: the
/// median over the picture.
double motion_px(const StereoImage& reference, const SweepSource& source, const cv::Mat& surface);

/// Zero-mean normalised correlation of windows of 2 * radius_px + 1 that lie on the surface, so
/// that a slanted or bent wall is compared as it is; the mean over the better half of the sources.
/// `surface`: CV_32F on the reference's grid, positive.
ScoreVolume sweep(const StereoImage& reference, const std::vector<SweepSource>& sources,
                  const cv::Mat& surface, const SweepRange& range, int radius_px);

}  // namespace rugae
