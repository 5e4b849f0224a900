#pragma once
// How long the cells of a study that are not made yet will take.

#include <map>
#include <vector>

#include "studies/run_cells.h"

namespace rugae {

/// By what this run has made so far. Cells count by their pixels, and by what of them is theirs to
/// make: a rendering or a motion that cells share counts for the first of them.
class TimeLeft {
 public:
  explicit TimeLeft(const std::vector<CellJob>& jobs);

  void made(const CellJob& job);
  /// Nothing was to be done: another cell was the same.
  void skipped(const CellJob& job);

  /// After so many seconds; infinite before the first cell is made.
  double seconds_left(double elapsed_s) const;

 private:
  std::map<int, double> weights_;  // by CellJob::index
  double left_ = 0.0, made_ = 0.0;
};

}  // namespace rugae
