#include "studies/tables.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/check.h"

namespace rugae {
namespace {

using nlohmann::json;

const std::vector<std::string> kSimulationFacts = {"frames", "path_length_mm", "min_clearance_mm"};

// Without arrays, and without what another run would measure otherwise.
json lasting(const json& metrics) {
  json out = metrics;
  out.erase("frames");
  out.erase("time");
  if (!out.contains("simulation")) return out;
  for (const auto& [key, value] : metrics.at("simulation").items())
    if (std::ranges::count(kSimulationFacts, key) == 0) out["simulation"].erase(key);
  return out;
}

void flatten(const json& node, const std::string& prefix, std::map<std::string, double>& row) {
  for (const auto& [key, value] : node.items()) {
    const std::string path = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object())
      flatten(value, path, row);
    else if (value.is_number())
      row[path] = value.get<double>();
  }
}

json settings_json(const std::vector<Setting>& settings) {
  json out = json::object();
  for (const Setting& s : settings) out[s.path] = s.value;
  return out;
}

}  // namespace

std::map<std::string, double> numbers_of(const CellResult& cell) {
  std::map<std::string, double> numbers;
  flatten(lasting(cell.metrics), "", numbers);
  return numbers;
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

std::vector<std::string> axis_paths(const std::vector<CellResult>& cells) {
  std::vector<std::string> paths;
  for (const CellResult& cell : cells)
    for (const Setting& axis : cell.cell.settings)
      if (std::ranges::count(paths, axis.path) == 0) paths.push_back(axis.path);
  return paths;
}

std::string row_start_names(const std::vector<std::string>& axes) {
  std::string text = "part,camera,trajectory,method";
  for (const std::string& axis : axes) text += "," + csv_field(axis);
  return text;
}

std::string row_start(const Cell& cell, const std::vector<std::string>& axes) {
  std::string text = fmt::format("{},{},{},{}", csv_field(cell.part), csv_field(cell.camera),
                                 csv_field(cell.trajectory), csv_field(cell.method));
  for (const std::string& axis : axes) text += "," + csv_field(value_of(cell, axis));
  return text;
}

json results_json(const Study& study, const std::vector<StudyPart>& parts) {
  json list = json::array(), held = json::array(), texts = json::array();
  json summaries = json::object();
  for (const StudyPart& part : parts) {
    for (const CellResult& cell : part.cells)
      list.push_back({{"part", cell.cell.part},
                      {"camera", cell.cell.camera},
                      {"trajectory", cell.cell.trajectory},
                      {"method", cell.cell.method},
                      {"axes", settings_json(cell.cell.settings)},
                      {"seed", cell.cell.seed},
                      {"dataset", cell.dataset.filename().string()},
                      {"estimate", cell.estimate.filename().string()},
                      {"metrics", lasting(cell.metrics)}});
    summaries[part.options.name] = to_json(part.summary);
    texts.push_back(part.options.text);
  }
  for (const GateOutcome& gate : all_gates(parts))
    held.push_back({{"cell", gate.cell},
                    {"metric", gate.metric},
                    {"expected", gate.expected},
                    {"found", gate.found},
                    {"reason", gate.reason},
                    {"passed", gate.passed}});
  return {{"title", study.title}, {"study", study.text}, {"parts", texts},
          {"cells", list},        {"gates", held},       {"summaries", summaries}};
}

json times_json(const std::vector<StudyPart>& parts) {
  json list = json::array();
  for (const StudyPart& part : parts)
    for (const CellResult& cell : part.cells)
      list.push_back({{"cell", cell.cell.title()},
                      {"time", cell.metrics.value("time", json())},
                      {"simulation", cell.metrics.value("simulation", json())}});
  return {{"cells", list}};
}

std::string table_csv(const std::vector<CellResult>& cells) {
  std::vector<std::map<std::string, double>> rows;
  std::set<std::string> metrics;
  for (const CellResult& cell : cells) {
    rows.push_back(numbers_of(cell));
    for (const auto& [path, value] : rows.back()) metrics.insert(path);
  }
  const std::vector<std::string> axes = axis_paths(cells);
  std::string text = row_start_names(axes) + ",seed";
  for (const std::string& metric : metrics) text += "," + csv_field(metric);
  text += "\n";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    text += fmt::format("{},{}", row_start(cells[i].cell, axes), cells[i].cell.seed);
    for (const std::string& metric : metrics) {
      const auto at = rows[i].find(metric);
      text += at == rows[i].end() ? "," : fmt::format(",{}", at->second);
    }
    text += "\n";
  }
  return text;
}

}  // namespace rugae
