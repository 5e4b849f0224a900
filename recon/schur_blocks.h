#pragma once
// How the solver of bundle adjustment cuts its work, and which blocks its equations have.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "recon/schur.h"

namespace rugae {

/// Work is cut into parts by the number of points alone, and their sums are added in order: the
/// same result for any number of threads.
struct PointParts {
  static constexpr std::size_t kPointsEach = 512, kMost = 8;
  std::size_t points, count;
  explicit PointParts(std::size_t n)
      : points(n), count(std::clamp<std::size_t>(n / kPointsEach, 1, kMost)) {}
  std::size_t begin(std::size_t part) const { return points * part / count; }
  template <typename Work>
  void each(Work work) const {
    tbb::parallel_for(std::size_t{0}, count, work);
  }
};

/// The upper triangle of a symmetric matrix of 6 x 6 blocks, only those that a point links. Blocks
/// are numbered row by row.
class BlockPattern {
 public:
  /// `slot_of` numbers the free cameras, -1 for those held.
  BlockPattern(const SchurProblem& problem, const std::vector<int>& slot_of, int free)
      : free_(free), place_(static_cast<std::size_t>(free) * free, -1) {
    std::vector<char> linked(place_.size(), 0);
    for (int c = 0; c < free; ++c) linked[at(c, c)] = 1;
    for (const SchurProblem::Point& point : problem.points)
      for (std::size_t i = 0; i < point.observations.size(); ++i)
        for (std::size_t j = i; j < point.observations.size(); ++j) {
          const int a = slot_of[point.observations[i].camera];
          const int b = slot_of[point.observations[j].camera];
          if (a >= 0 && b >= 0) linked[at(a, b)] = 1;
        }
    for (int a = 0; a < free; ++a)
      for (int b = a; b < free; ++b)
        if (linked[at(a, b)]) {
          place_[at(a, b)] = static_cast<int>(blocks_.size());
          blocks_.emplace_back(a, b);
        }
  }
  int free() const { return free_; }
  int place(int a, int b) const { return place_[at(a, b)]; }
  const std::vector<std::pair<int, int>>& blocks() const { return blocks_; }

 private:
  std::size_t at(int a, int b) const { return static_cast<std::size_t>(a) * free_ + b; }
  int free_;
  std::vector<int> place_;
  std::vector<std::pair<int, int>> blocks_;
};

}  // namespace rugae
