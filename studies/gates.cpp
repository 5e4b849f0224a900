#include "studies/gates.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"

namespace rugae {
namespace {

using nlohmann::json;

// Every path to a number (or to a missing one) in the metrics; arrays are for plots, not gates.
void list_paths(const json& node, const std::string& prefix, std::vector<std::string>& paths) {
  for (const auto& [key, value] : node.items()) {
    const std::string path = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object())
      list_paths(value, path, paths);
    else if (value.is_number() || value.is_null())
      paths.push_back(path);
  }
}

bool names(const Gate& gate, const Cell& cell) {
  const auto fits = [](const std::vector<std::string>& wanted, const std::string& is) {
    return wanted.empty() || std::ranges::count(wanted, is) > 0;
  };
  for (const Setting& setting : gate.settings)
    if (std::ranges::count(cell.settings, setting) == 0) return false;
  return fits(gate.camera, cell.camera) && fits(gate.trajectory, cell.trajectory) &&
         fits(gate.method, cell.method);
}

std::string bounds(const Gate& gate) {
  std::string text;
  if (gate.above) text = fmt::format("above {:g}", *gate.above);
  if (gate.below) text += fmt::format("{}below {:g}", text.empty() ? "" : " and ", *gate.below);
  return text;
}

bool exists(const json& metrics, const std::string& path) {
  std::vector<std::string> paths;
  list_paths(metrics, "", paths);
  return std::ranges::count(paths, path) > 0;
}

std::string unknown(const json& metrics, const std::string& path) {
  std::vector<std::string> paths;
  list_paths(metrics, "", paths);
  return "no such metric" + did_you_mean(path, paths);
}

GateOutcome hold(const Gate& gate, const CellResult& cell) {
  GateOutcome outcome{cell.cell.title(), gate.metric, bounds(gate), {}, gate.reason, false};
  const json& value = metric_at(cell.metrics, gate.metric);
  if (value.is_number()) {
    const double number = value.get<double>();
    outcome.found = fmt::format("{:g}", number);
    // Written so that a NaN fails.
    outcome.passed = std::isfinite(number) && (!gate.above || number > *gate.above) &&
                     (!gate.below || number < *gate.below);
  } else {
    outcome.found =
        exists(cell.metrics, gate.metric) ? "not measured" : unknown(cell.metrics, gate.metric);
  }
  return outcome;
}

}  // namespace

std::string GateOutcome::line() const {
  return fmt::format("{}: {} is {}, expected {}: {}", cell, metric, found, expected, reason);
}

const json& metric_at(const json& metrics, const std::string& path) {
  static const json none;  // null
  const json* node = &metrics;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const std::string key = path.substr(begin, end - begin);
    if (!node->is_object() || !node->contains(key)) return none;
    node = &node->at(key);
    begin = end + 1;
  }
  return *node;
}

std::vector<GateOutcome> hold_gates(const std::vector<Gate>& gates,
                                    const std::vector<CellResult>& cells) {
  std::vector<GateOutcome> outcomes;
  for (const Gate& gate : gates) {
    const std::size_t before = outcomes.size();
    for (const CellResult& cell : cells)
      if (names(gate, cell.cell)) outcomes.push_back(hold(gate, cell));
    if (outcomes.size() == before)
      outcomes.push_back(
          {fmt::format("camera '{}', trajectory '{}', method '{}'", fmt::join(gate.camera, ", "),
                       fmt::join(gate.trajectory, ", "), fmt::join(gate.method, ", ")),
           gate.metric, bounds(gate), "in no cell of the study", gate.reason, false});
  }
  return outcomes;
}

}  // namespace rugae
