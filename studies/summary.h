#pragma once
// Tables, curves, bars and findings of the cells of a study.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "studies/cell.h"
#include "studies/repeats.h"
#include "studies/summary_spec.h"

namespace rugae {

/// A place of a table: the cells of its row and column together.
struct TableEntry {
  Repeats ours;    // of those that measured it, in the table's unit
  int failed = 0;  // cells that did not
  std::optional<double> published;
};
struct SummaryTable {
  TableSpec spec;
  std::vector<std::string> rows, columns;  // in the order of the cells
  std::vector<std::vector<TableEntry>> entries;
};

struct CurveLine {
  std::string name;
  std::vector<double> x;
  std::vector<TableEntry> y;
  /// The strengths between which the line breaks: the first at which fewer than nine frames in ten
  /// are tracked, the metric is not measured, or is more than three times what it is at the first.
  std::optional<std::pair<double, double>> breaks_between;
};
struct SummaryCurve {
  CurveSpec spec;
  std::vector<CurveLine> lines;
};

struct SummaryBars {
  BarsSpec spec;
  std::vector<std::string> names;
  std::vector<TableEntry> entries;
};

/// The ratio of the metric (there over here), over pairs of cells that agree in all else: the
/// geometric mean and its 95 % interval (Student's t on the logarithms).
struct SummaryFinding {
  FindingSpec spec;
  int pairs = 0;
  int failed = 0;  // pairs of which one was not measured
  double ratio = 0.0, low = 0.0, high = 0.0;
  /// "confirmed" where the whole interval is above 1, "refuted" where it is below, else "open".
  std::string verdict() const;
};

struct Summary {
  std::vector<SummaryTable> tables;
  std::vector<SummaryCurve> curves;
  std::vector<SummaryBars> bars;
  std::vector<SummaryFinding> findings;
};

Summary summarise(const SummarySpecs& specs, const std::vector<CellResult>& cells);

/// What `what` (camera, trajectory, method, seed, or an axis) is in a cell.
std::string value_of(const Cell& cell, const std::string& what);

/// All of it but what is of times, which another run would measure otherwise.
nlohmann::json to_json(const Summary& summary);

/// A table: row, column, mean, half width of the 95 % interval, cells, failed, published, ratio.
std::string table_csv(const SummaryTable& table);

}  // namespace rugae
