#include "studies/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/check.h"
#include "studies/gates.h"
#include "studies/published.h"

namespace rugae {
namespace {

constexpr double kLostShare = 0.9;     // of the frames, tracked: fewer is broken
constexpr double kBrokenFactor = 3.0;  // of the error at the first strength: more is broken
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double metric_of(const CellResult& cell, const std::string& path) {
  const auto& value = metric_at(cell.metrics, path);
  return value.is_number() ? value.get<double>() : kNone;
}

// The values in the order in which they first come.
std::vector<std::string> values_of(const std::vector<CellResult>& cells, const std::string& what) {
  std::vector<std::string> values;
  for (const CellResult& cell : cells) {
    const std::string value = value_of(cell.cell, what);
    if (std::ranges::count(values, value) == 0) values.push_back(value);
  }
  return values;
}

struct Chosen {
  std::string what, value;
};

template <typename Spec>
TableEntry entry_of(const Spec& spec, const std::vector<CellResult>& cells,
                    const std::vector<Chosen>& chosen) {
  TableEntry entry;
  std::vector<double> values;
  for (const CellResult& cell : cells) {
    if (!std::ranges::all_of(
            chosen, [&](const Chosen& c) { return value_of(cell.cell, c.what) == c.value; }))
      continue;
    const double value = spec.scale * metric_of(cell, spec.metric);
    if (std::isfinite(value))
      values.push_back(value);
    else
      ++entry.failed;
  }
  entry.ours = repeats_of(values);
  return entry;
}

SummaryTable table_of(const TableSpec& spec, const std::vector<CellResult>& cells) {
  SummaryTable table{spec, values_of(cells, spec.rows), values_of(cells, spec.columns), {}};
  for (const std::string& row : table.rows) {
    auto& entries = table.entries.emplace_back();
    for (const std::string& column : table.columns) {
      std::vector<Chosen> chosen = {{spec.rows, row}, {spec.columns, column}};
      if (!spec.method.empty()) chosen.push_back({"method", spec.method});
      entries.push_back(entry_of(spec, cells, chosen));
      entries.back().published = published(spec.published, row, column);
    }
  }
  return table;
}

void find_break(CurveLine& line, const std::vector<TableEntry>& tracked) {
  for (std::size_t i = 0; i < line.x.size(); ++i) {
    const bool holds = line.y[i].failed == 0 &&
                       line.y[i].ours.mean <= kBrokenFactor * line.y[0].ours.mean &&
                       tracked[i].ours.mean >= kLostShare;
    if (holds) continue;
    line.breaks_between = {line.x[i > 0 ? i - 1 : 0], line.x[i]};
    return;
  }
}

SummaryCurve curve_of(const CurveSpec& spec, const std::vector<CellResult>& cells) {
  SummaryCurve curve{spec, {}};
  CurveSpec of_tracked = spec;
  of_tracked.metric = "tracking.tracked_share";
  of_tracked.scale = 1.0;
  for (const std::string& name : values_of(cells, spec.lines)) {
    CurveLine line{name, {}, {}, {}};
    std::vector<TableEntry> tracked;
    for (const std::string& value : values_of(cells, spec.over)) {
      const std::vector<Chosen> here{{spec.lines, name}, {spec.over, value}};
      line.x.push_back(number_in(value).value_or(kNone));
      line.y.push_back(entry_of(spec, cells, here));
      tracked.push_back(entry_of(of_tracked, cells, here));
    }
    find_break(line, tracked);
    curve.lines.push_back(std::move(line));
  }
  return curve;
}

SummaryBars bars_of(const BarsSpec& spec, const std::vector<CellResult>& cells) {
  SummaryBars bars{spec, values_of(cells, spec.over), {}};
  for (const std::string& name : bars.names)
    bars.entries.push_back(entry_of(spec, cells, {{spec.over, name}}));
  return bars;
}

// All that cells differ in but `what`.
std::string others(const Cell& cell, const std::string& what) {
  std::string key;
  for (const char* list : {"camera", "trajectory", "method", "seed"})
    if (what != list) key += value_of(cell, list) + "\n";
  for (const Setting& setting : cell.settings)
    if (what != setting.path) key += setting.value + "\n";
  return key;
}

SummaryFinding finding_of(const FindingSpec& spec, const std::vector<CellResult>& cells) {
  SummaryFinding finding;
  finding.spec = spec;
  std::map<std::string, std::pair<double, double>> pairs;  // more and less
  for (const CellResult& cell : cells) {
    const std::string value = value_of(cell.cell, spec.more.what);
    auto& pair = pairs.try_emplace(others(cell.cell, spec.more.what), kNone, kNone).first->second;
    if (value == spec.more.value) pair.first = metric_of(cell, spec.metric);
    if (value == spec.less.value) pair.second = metric_of(cell, spec.metric);
  }
  std::vector<double> logs;
  for (const auto& [key, pair] : pairs) {
    if (pair.first > 0.0 && pair.second > 0.0)
      logs.push_back(std::log(pair.first / pair.second));
    else
      ++finding.failed;
  }
  const Repeats mean = repeats_of(logs);
  finding.pairs = mean.count;
  finding.ratio = std::exp(mean.mean);
  finding.low = std::exp(mean.mean - mean.half_width);
  finding.high = std::exp(mean.mean + mean.half_width);
  return finding;
}

}  // namespace

std::string value_of(const Cell& cell, const std::string& what) {
  if (what == "camera") return cell.camera;
  if (what == "trajectory") return cell.trajectory;
  if (what == "method") return cell.method;
  if (what == "seed") return std::to_string(cell.seed);
  for (const Setting& setting : cell.settings)
    if (setting.path == what) return setting.value;
  return {};
}

std::string SummaryFinding::verdict() const {
  return low > 1.0 ? "confirmed" : high < 1.0 ? "refuted" : "open";
}

Summary summarise(const SummarySpecs& specs, const std::vector<CellResult>& cells) {
  Summary summary;
  for (const TableSpec& spec : specs.tables) summary.tables.push_back(table_of(spec, cells));
  for (const CurveSpec& spec : specs.curves) summary.curves.push_back(curve_of(spec, cells));
  for (const BarsSpec& spec : specs.bars) summary.bars.push_back(bars_of(spec, cells));
  for (const FindingSpec& spec : specs.findings)
    summary.findings.push_back(finding_of(spec, cells));
  return summary;
}

}  // namespace rugae
