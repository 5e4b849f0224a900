#include "validate/error_stats.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rugae {

double median(std::vector<double> values) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  if (values.empty() || std::ranges::any_of(values, [](double v) { return std::isnan(v); }))
    return kNan;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

ErrorStats error_stats(const std::vector<double>& errors) {
  ErrorStats stats;
  stats.count = errors.size();
  if (errors.empty()) return stats;
  double squares = 0.0, sum = 0.0;
  for (const double error : errors) {
    squares += error * error;
    sum += error;
    if (!(error <= stats.max)) stats.max = error;  // a NaN is taken up and stays
    if (std::isnan(stats.max)) break;
  }
  if (std::isnan(stats.max)) {
    stats.rmse = stats.mean = stats.median = stats.max;
    return stats;
  }
  const auto n = static_cast<double>(errors.size());
  stats.rmse = std::sqrt(squares / n);
  stats.mean = sum / n;
  stats.median = median(errors);
  return stats;
}

}  // namespace rugae
