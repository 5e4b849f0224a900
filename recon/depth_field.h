#pragma once
// A smooth function over a picture with one known ingredient of unknown strength, fitted to
// scattered values.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "core/types.h"

namespace rugae {

struct FieldSample {
  Vec2 pixel;  // (0.5, 0.5) convention
  double value = 0.0;
  double ingredient = 0.0;  // the known part at this pixel, before scaling
  double weight = 1.0;
};

/// value(x) = spline(x) + scale * ingredient(x), the spline a uniform cubic B-spline.
struct DepthField {
  double spacing_px = 0.0;  // of the control points
  int columns = 0, rows = 0;
  Eigen::VectorXd control;  // row by row
  double scale = 0.0;
  double sigma = 0.0;             // robust spread of the residuals
  double held_out = 0.0;          // mean absolute residual at samples left out
  std::vector<double> residuals;  // value minus field, of every sample
  std::vector<bool> kept;         // within three sigma

  double spline(const Vec2& pixel) const;
};

/// Least squares with a thin-plate penalty whose strength is chosen by leaving out every fifth
/// sample, and with Cauchy weights, so that wrong samples lose their say. Empty with fewer than 12
/// samples or when they lie on a line. Residuals below `min_sigma` are never held against a sample.
std::optional<DepthField> fit_depth_field(const std::vector<FieldSample>& samples, cv::Size size,
                                          double spacing_px, double min_sigma);

}  // namespace rugae
