#pragma once
// A few of many.

#include <vector>

namespace rugae {

/// `count` of 0 ... n-1, evenly spread, ascending, without repetition.
inline std::vector<int> spread(int n, int count) {
  std::vector<int> which;
  for (int i = 0; i < count; ++i) {
    const int at = static_cast<int>((i + 0.5) * n / count);
    if (at < n && (which.empty() || which.back() != at)) which.push_back(at);
  }
  return which;
}

}  // namespace rugae
