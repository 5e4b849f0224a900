#pragma once
// Statistics of errors that come in one after the other, in a memory that does not grow with them.

#include <cstdint>
#include <vector>

#include "validate/error_stats.h"

namespace rugae {

/// Everything but the median is exact; errors are not negative and below 1e6.
class RunningErrors {
 public:
  /// Counts the errors below each of these as well.
  explicit RunningErrors(std::vector<double> thresholds = {});

  /// Sums are taken in the order of the calls: add in an order that does not depend on threads.
  void add(double error);

  std::size_t count() const { return count_; }
  /// As error_stats(); the median to 0.1 % of itself where it is above 1e-6. A NaN among the errors
  /// makes every value NaN.
  ErrorStats stats() const;
  /// Share of the errors below the k-th threshold, 0 to 1; a NaN is below none. Meaningless without
  /// errors.
  double share_below(std::size_t k) const;

 private:
  double at_rank(std::size_t rank) const;

  std::vector<double> thresholds_;
  std::vector<std::size_t> below_;
  std::vector<std::uint64_t> bins_;  // of the errors' logarithms; the first holds all smaller ones
  std::size_t count_ = 0, nans_ = 0;
  double sum_ = 0.0, squares_ = 0.0, max_ = 0.0;
};

}  // namespace rugae
