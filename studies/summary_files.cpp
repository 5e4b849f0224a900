// A summary as files: JSON for programs, CSV for tables.

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "studies/summary.h"
#include "studies/tables.h"

namespace rugae {
namespace {

using nlohmann::json;

json finite(double value) { return std::isfinite(value) ? json(value) : json(); }

bool of_times(const std::string& metric) {
  return metric.starts_with("time.") || metric.starts_with("simulation.");
}

json json_of(const TableEntry& entry) {
  json node = {{"mean", finite(entry.ours.mean)},
               {"half_width_95", finite(entry.ours.half_width)},
               {"cells", entry.ours.count},
               {"failed", entry.failed}};
  if (entry.published) {
    node["published"] = *entry.published;
    node["ratio"] = finite(entry.ours.mean / *entry.published);
  }
  return node;
}

json json_of(const SummaryTable& table) {
  json rows = json::object();
  for (std::size_t r = 0; r < table.rows.size(); ++r)
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      rows[table.rows[r]][table.columns[c]] = json_of(table.entries[r][c]);
  return {{"title", table.spec.title},
          {"metric", table.spec.metric},
          {"unit", table.spec.unit},
          {"rows", rows}};
}

json json_of(const SummaryCurve& curve) {
  json lines = json::object();
  for (const CurveLine& line : curve.lines) {
    json y = json::array();
    for (const TableEntry& entry : line.y) y.push_back(json_of(entry));
    lines[line.name] = {
        {"x", line.x},
        {"y", y},
        {"breaks_between", line.breaks_between ? json::array({line.breaks_between->first,
                                                              line.breaks_between->second})
                                               : json()}};
  }
  return {{"title", curve.spec.title},
          {"metric", curve.spec.metric},
          {"unit", curve.spec.unit},
          {"over", curve.spec.over},
          {"lines", lines}};
}

json json_of(const SummaryBars& bars) {
  json entries = json::object();
  for (std::size_t i = 0; i < bars.names.size(); ++i)
    entries[bars.names[i]] = json_of(bars.entries[i]);
  return {{"title", bars.spec.title},
          {"metric", bars.spec.metric},
          {"unit", bars.spec.unit},
          {"over", bars.spec.over},
          {"bars", entries}};
}

json json_of(const SummaryFinding& finding) {
  return {{"claim", finding.spec.claim},   {"metric", finding.spec.metric},
          {"verdict", finding.verdict()},  {"ratio", finite(finding.ratio)},
          {"low_95", finite(finding.low)}, {"high_95", finite(finding.high)},
          {"pairs", finding.pairs},        {"failed", finding.failed}};
}

template <typename T>
json list_of(const std::vector<T>& all) {
  json list = json::array();
  for (const T& one : all)
    if (!of_times(one.spec.metric)) list.push_back(json_of(one));
  return list;
}

std::string field_of(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : std::string();
}

}  // namespace

json to_json(const Summary& summary) {
  return {{"tables", list_of(summary.tables)},
          {"curves", list_of(summary.curves)},
          {"bars", list_of(summary.bars)},
          {"findings", list_of(summary.findings)}};
}

std::string table_csv(const SummaryTable& table) {
  std::string text = fmt::format("{},{},mean,half_width_95,cells,failed,published,ratio\n",
                                 csv_field(table.spec.rows), csv_field(table.spec.columns));
  for (std::size_t r = 0; r < table.rows.size(); ++r)
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      const TableEntry& e = table.entries[r][c];
      text += fmt::format("{},{},{},{},{},{},{},{}\n", csv_field(table.rows[r]),
                          csv_field(table.columns[c]), field_of(e.ours.mean),
                          field_of(e.ours.half_width), e.ours.count, e.failed,
                          e.published ? field_of(*e.published) : std::string(),
                          e.published ? field_of(e.ours.mean / *e.published) : std::string());
    }
  return text;
}

}  // namespace rugae
