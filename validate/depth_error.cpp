#include "validate/depth_error.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "validate/error_stats.h"

namespace rugae {
namespace {

bool known(float depth) { return std::isfinite(depth) && depth > 0.0f; }

// Calls f(estimate, truth) at every pixel with a true depth.
template <typename F>
void for_each_true_pixel(const cv::Mat& estimate, const cv::Mat& truth, F&& f) {
  check(estimate.type() == CV_32F && truth.type() == CV_32F, "depth images are not CV_32F");
  check(estimate.size() == truth.size(), "estimated depth is {}x{}, true depth {}x{}",
        estimate.cols, estimate.rows, truth.cols, truth.rows);
  for (int y = 0; y < truth.rows; ++y) {
    const auto* e = estimate.ptr<float>(y);
    const auto* t = truth.ptr<float>(y);
    for (int x = 0; x < truth.cols; ++x)
      if (known(t[x])) f(e[x], t[x]);
  }
}

}  // namespace

std::optional<DepthError> depth_error(const cv::Mat& estimate, const cv::Mat& truth_mm,
                                      double mm_per_unit) {
  check(std::isfinite(mm_per_unit) && mm_per_unit > 0.0, "depth_error: scale is {}", mm_per_unit);
  DepthError sum;
  std::size_t with_truth = 0, with_both = 0;
  for_each_true_pixel(estimate, truth_mm, [&](float unscaled, float truth) {
    ++with_truth;
    if (!known(unscaled)) return;
    ++with_both;
    const double d = mm_per_unit * unscaled, difference = d - truth;
    const double log_ratio = std::log(d / truth);
    constexpr double kDelta = 1.25;
    sum.abs_rel += std::abs(difference) / truth;
    sum.sq_rel_mm += difference * difference / truth;
    sum.rmse_mm += difference * difference;
    sum.rmse_log += log_ratio * log_ratio;
    sum.delta_125 += std::max(d / truth, truth / d) < kDelta ? 1.0 : 0.0;
  });
  if (with_both == 0) return std::nullopt;
  const auto n = static_cast<double>(with_both);
  return DepthError{sum.abs_rel / n,
                    sum.sq_rel_mm / n,
                    std::sqrt(sum.rmse_mm / n),
                    std::sqrt(sum.rmse_log / n),
                    sum.delta_125 / n,
                    n / static_cast<double>(with_truth),
                    1.0};
}

std::optional<double> median_scale(const cv::Mat& estimate, const cv::Mat& truth_mm) {
  std::vector<double> estimates, truths;
  for_each_true_pixel(estimate, truth_mm, [&](float e, float t) {
    if (!known(e)) return;
    estimates.push_back(e);
    truths.push_back(t);
  });
  if (estimates.empty()) return std::nullopt;
  return median(std::move(truths)) / median(std::move(estimates));
}

std::optional<DepthError> mean_of(const std::vector<DepthError>& frames) {
  if (frames.empty()) return std::nullopt;
  DepthError sum;
  for (const DepthError& frame : frames) {
    sum.abs_rel += frame.abs_rel;
    sum.sq_rel_mm += frame.sq_rel_mm;
    sum.rmse_mm += frame.rmse_mm;
    sum.rmse_log += frame.rmse_log;
    sum.delta_125 += frame.delta_125;
    sum.valid_share += frame.valid_share;
  }
  const auto n = static_cast<double>(frames.size());
  return DepthError{sum.abs_rel / n,
                    sum.sq_rel_mm / n,
                    sum.rmse_mm / n,
                    sum.rmse_log / n,
                    sum.delta_125 / n,
                    sum.valid_share / n,
                    n};
}

}  // namespace rugae
