#include "validate/running_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rugae {
namespace {

constexpr double kSmallest = 1e-6, kLargest = 1e6;
constexpr double kLogStep = 1e-3;  // of a bin: 0.1 %

std::size_t bins() {
  return 2 + static_cast<std::size_t>(std::log(kLargest / kSmallest) / kLogStep);
}

}  // namespace

RunningErrors::RunningErrors(std::vector<double> thresholds)
    : thresholds_(std::move(thresholds)), below_(thresholds_.size(), 0), bins_(bins(), 0) {}

void RunningErrors::add(double error) {
  ++count_;
  if (std::isnan(error)) {
    ++nans_;
    return;
  }
  sum_ += error;
  squares_ += error * error;
  max_ = std::max(max_, error);
  for (std::size_t k = 0; k < thresholds_.size(); ++k)
    if (error < thresholds_[k]) ++below_[k];
  const double place = error > kSmallest ? 1.0 + std::log(error / kSmallest) / kLogStep : 0.0;
  ++bins_[static_cast<std::size_t>(std::min(place, static_cast<double>(bins_.size() - 1)))];
}

// The middle of the bin that holds the error of this rank.
double RunningErrors::at_rank(std::size_t rank) const {
  std::size_t bin = 0;
  for (std::uint64_t before = bins_[0]; before <= rank; before += bins_[bin]) ++bin;
  if (bin == 0) return 0.0;
  return kSmallest * std::exp((static_cast<double>(bin) - 0.5) * kLogStep);
}

ErrorStats RunningErrors::stats() const {
  ErrorStats stats;
  stats.count = count_;
  if (count_ == 0) return stats;
  if (nans_ > 0) {
    stats.rmse = stats.mean = stats.median = stats.max = std::numeric_limits<double>::quiet_NaN();
    return stats;
  }
  const auto n = static_cast<double>(count_);
  stats.mean = sum_ / n;
  stats.rmse = std::sqrt(squares_ / n);
  stats.max = max_;
  stats.median = 0.5 * (at_rank((count_ - 1) / 2) + at_rank(count_ / 2));
  return stats;
}

double RunningErrors::share_below(std::size_t k) const {
  return static_cast<double>(below_.at(k)) / static_cast<double>(count_);
}

}  // namespace rugae
