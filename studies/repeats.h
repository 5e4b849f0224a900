#pragma once
// The same cell with several seeds: means, and how sure they are.

#include <string>
#include <vector>

#include "studies/cell.h"

namespace rugae {

struct Repeats {
  int count = 0;
  double mean = 0.0;
  double half_width = 0.0;  // of the 95 % interval of the mean; NaN for fewer than two
};

/// Mean and its interval by Student's t (the numbers are taken for normal). NaN among them gives
/// NaN.
Repeats repeats_of(const std::vector<double>& values);

/// The value that Student's t with that many degrees of freedom stays within with 95 % probability,
/// to 1e-3: 12.706 for 1, 1.960 for many.
double student_t_95(int degrees_of_freedom);

/// A row for each camera, trajectory, method and combination of the axes: of every metric the mean
/// over the seeds, the half width of its 95 % interval, and how many seeds measured it.
std::string repeats_csv(const std::vector<CellResult>& cells);

}  // namespace rugae
