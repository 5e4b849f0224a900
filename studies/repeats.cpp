#include "studies/repeats.h"

#include <cmath>
#include <limits>
#include <map>

#include "core/check.h"
#include "core/units.h"
#include "studies/tables.h"

namespace rugae {
namespace {

// Probability that |t| is at most `t`, by the finite series for whole degrees of freedom
// (Abramowitz and Stegun 26.7.3 and 26.7.4).
double student_within(double t, int nu) {
  const double angle = std::atan(t / std::sqrt(nu)), s = std::sin(angle), c = std::cos(angle);
  double sum = 0.0;
  if (nu % 2 == 1) {
    double term = c;
    for (int k = 1; k <= nu - 2; k += 2) {
      sum += term;
      term *= c * c * (k + 1.0) / (k + 2.0);
    }
    return 2.0 / kPi * (angle + s * sum);
  }
  double term = 1.0;
  for (int k = 0; k <= nu - 2; k += 2) {
    sum += term;
    term *= c * c * (k + 1.0) / (k + 2.0);
  }
  return s * sum;
}

}  // namespace

double student_t_95(int degrees_of_freedom) {
  check(degrees_of_freedom >= 1, "Student's t: {} degrees of freedom, expected at least 1",
        degrees_of_freedom);
  double low = 0.0, high = 20.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (student_within(middle, degrees_of_freedom) < 0.95 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Repeats repeats_of(const std::vector<double>& values) {
  Repeats r;
  r.count = static_cast<int>(values.size());
  r.half_width = std::numeric_limits<double>::quiet_NaN();
  if (values.empty()) {
    r.mean = r.half_width;
    return r;
  }
  for (const double v : values) r.mean += v / r.count;
  if (r.count < 2) return r;
  double squares = 0.0;
  for (const double v : values) squares += (v - r.mean) * (v - r.mean);
  r.half_width = student_t_95(r.count - 1) * std::sqrt(squares / (r.count - 1) / r.count);
  return r;
}

std::string repeats_csv(const std::vector<CellResult>& cells) {
  using Values = std::map<std::string, std::vector<double>>;
  std::map<std::string, Values> groups;
  std::vector<std::string> order;  // of the groups, as the cells come
  const std::vector<std::string> axes = axis_paths(cells);
  for (const CellResult& cell : cells) {
    const std::string key = row_start(cell.cell, axes);
    const auto [group, fresh] = groups.try_emplace(key);
    if (fresh) order.push_back(key);
    for (const auto& [metric, value] : numbers_of(cell)) group->second[metric].push_back(value);
  }
  std::string text = row_start_names(axes) + ",metric,mean,half_width_95,seeds\n";
  for (const std::string& key : order)
    for (const auto& [metric, values] : groups.at(key)) {
      const Repeats r = repeats_of(values);
      text += fmt::format(
          "{},{},{},{},{}\n", key, csv_field(metric), r.mean,
          std::isnan(r.half_width) ? std::string() : fmt::format("{}", r.half_width), r.count);
    }
  return text;
}

}  // namespace rugae
