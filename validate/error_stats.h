#pragma once
// Summary of a list of errors.

#include <cstddef>
#include <vector>

namespace rugae {

/// All in the unit of the errors. With no errors `count` is 0 and the values mean nothing.
struct ErrorStats {
  double rmse = 0.0, mean = 0.0, median = 0.0, max = 0.0;
  std::size_t count = 0;
};

/// Summed in the order given. A NaN among the errors makes every value NaN: it is never skipped.
ErrorStats error_stats(const std::vector<double>& errors);

/// The middle value, or the mean of the two middle ones; NaN for an empty list or when a value is
/// NaN.
double median(std::vector<double> values);

}  // namespace rugae
