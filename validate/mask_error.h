#pragma once
// Errors of detection masks.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace rugae {

/// Pixels by what was found and what is true. Scores without a meaning are empty, never 0 or 1:
/// precision where nothing was found, recall where nothing is true, F1 and IoU where neither.
struct MaskError {
  std::uint64_t both = 0, found_only = 0, true_only = 0, neither = 0;

  std::uint64_t found() const { return both + found_only; }
  std::uint64_t truly() const { return both + true_only; }
  std::uint64_t pixels() const { return found() + true_only + neither; }
  std::optional<double> precision() const;  // of what was found, the share that is true
  std::optional<double> recall() const;     // of what is true, the share that was found
  std::optional<double> f1() const;         // their harmonic mean, 2 both / (found + truly)
  std::optional<double> iou() const;        // both / (both + found only + true only)

  MaskError& operator+=(const MaskError& other);
  bool operator==(const MaskError&) const = default;
};

/// CV_8U masks of one size, set where not 0; counted where `where` is set (empty: everywhere).
/// Throws Error when sizes or types differ.
MaskError mask_error(const cv::Mat& found, const cv::Mat& truly, const cv::Mat& where = {});

}  // namespace rugae
