#pragma once
// Long work, some of it at a time.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/progress.h"

namespace rugae {

/// Does it for each number below `count`, `lot` of them side by side, with a step of the progress
/// line after each lot.
template <typename Do>
void do_in_lots(std::size_t count, std::size_t lot, Progress& progress, Do one) {
  for (std::size_t begin = 0; begin < count; begin += lot) {
    const std::size_t end = std::min(count, begin + lot);
    tbb::parallel_for(begin, end, one);
    progress.step(end - begin);
  }
}

/// Calls add(i, make(i)) for each number below `count` in this order, `lot` of them made side by
/// side and held.
template <typename Make, typename Add>
void make_in_lots(std::size_t count, std::size_t lot, Progress& progress, Make make, Add add) {
  using Made = decltype(make(std::size_t{0}));
  for (std::size_t begin = 0; begin < count; begin += lot) {
    const std::size_t end = std::min(count, begin + lot);
    std::vector<Made> made(end - begin);
    tbb::parallel_for(begin, end, [&](std::size_t i) { made[i - begin] = make(i); });
    for (std::size_t i = begin; i < end; ++i) add(i, made[i - begin]);
    progress.step(end - begin);
  }
}

}  // namespace rugae
