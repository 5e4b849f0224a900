#include "dataset/contest.h"

#include <algorithm>
#include <limits>

#include "dataset/warp.h"

namespace rugae {
namespace {

// An explanation has to leave at most this share of the disagreement: right ones leave a tenth or
// less of it, wrong ones seldom less than a half.
constexpr double kClear = 0.35;
// Explanations within this factor of the best are alike; the first of them is meant.
constexpr double kAlike = 1.3;

}  // namespace

Contest::Contest(const std::vector<std::vector<double>>& errors) {
  for (const auto& e : errors) {
    medians.push_back(median_of(e));
    counts.push_back(e.size());
  }
}

std::size_t Contest::winner(double sound, double most) const {
  double best = std::numeric_limits<double>::infinity();
  const auto counted = [&](std::size_t i) {
    return static_cast<double>(counts[i]) >= kFewSamples && 4 * counts[i] >= counts[0];
  };
  for (std::size_t i = 1; i < medians.size(); ++i)
    if (counted(i)) best = std::min(best, medians[i]);
  if (!(medians[0] > sound) || !(best <= kClear * medians[0]) || !(best <= most)) return 0;
  for (std::size_t i = 1; i < medians.size(); ++i)
    if (counted(i) && medians[i] <= std::max(kAlike * best, sound)) return i;
  return 0;
}

double Contest::margin(std::size_t winner) const {
  return medians[0] / std::max(medians[winner], 1e-12);
}

}  // namespace rugae
