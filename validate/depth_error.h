#pragma once
// Errors of estimated depth images.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

namespace rugae {

/// Over the pixels where both depths are known (finite and above 0), d estimated, d* true:
/// AbsRel mean |d - d*| / d*; SqRel mean (d - d*)^2 / d*; RMSE; RMSE of ln d - ln d*;
/// the share of pixels with max(d/d*, d*/d) < 1.25. Eigen, Puhrsch and Fergus, NIPS 2014,
/// section 4.3, arXiv:1406.2283.
struct DepthError {
  double abs_rel = 0.0, sq_rel_mm = 0.0, rmse_mm = 0.0, rmse_log = 0.0, delta_125 = 0.0;
  double valid_share = 0.0;  // pixels with both depths, of those with a true depth
  double frames = 0.0;       // averaged over; 1 for a single frame
};

/// CV_32F images of one size: the estimate in map units, the truth in mm. Empty when no pixel has
/// both. Throws Error when sizes or types differ.
std::optional<DepthError> depth_error(const cv::Mat& estimate, const cv::Mat& truth_mm,
                                      double mm_per_unit);

/// median(d*) / median(d) over the pixels with both depths: the usual way to give a depth without
/// scale the right one, frame by frame. Empty when no pixel has both.
std::optional<double> median_scale(const cv::Mat& estimate, const cv::Mat& truth_mm);

/// Each frame counts the same; empty for an empty list.
std::optional<DepthError> mean_of(const std::vector<DepthError>& frames);

}  // namespace rugae
