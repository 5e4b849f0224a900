#include "studies/tables.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/check.h"

namespace rugae {
namespace {

using nlohmann::json;

json without_arrays(const json& metrics) {
  json out = metrics;
  out.erase("frames");
  return out;
}

void flatten(const json& node, const std::string& prefix, std::map<std::string, std::string>& row) {
  for (const auto& [key, value] : node.items()) {
    const std::string path = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object())
      flatten(value, path, row);
    else if (value.is_number())
      row[path] = value.dump();
  }
}

std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\n") == std::string::npos) return cell;
  std::string out = "\"";
  for (const char c : cell) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

}  // namespace

json results_json(const StudyOptions& study, const std::string& study_text,
                  const std::vector<CellResult>& cells, const std::vector<GateOutcome>& gates) {
  json list = json::array(), held = json::array();
  for (const CellResult& cell : cells)
    list.push_back({{"camera", cell.cell.camera},
                    {"trajectory", cell.cell.trajectory},
                    {"method", cell.cell.method},
                    {"dataset", cell.dataset.filename().string()},
                    {"estimate", cell.estimate.filename().string()},
                    {"metrics", without_arrays(cell.metrics)}});
  for (const GateOutcome& gate : gates)
    held.push_back({{"cell", gate.cell},
                    {"metric", gate.metric},
                    {"expected", gate.expected},
                    {"found", gate.found},
                    {"reason", gate.reason},
                    {"passed", gate.passed}});
  return {{"title", study.title}, {"study", study_text}, {"cells", list}, {"gates", held}};
}

std::string table_csv(const std::vector<CellResult>& cells) {
  std::vector<std::map<std::string, std::string>> rows;
  std::vector<std::string> columns;
  for (const CellResult& cell : cells) {
    flatten(without_arrays(cell.metrics), "", rows.emplace_back());
    for (const auto& [path, value] : rows.back())
      if (std::ranges::count(columns, path) == 0) columns.push_back(path);
  }
  std::ranges::sort(columns);
  std::string text = "camera,trajectory,method";
  for (const std::string& column : columns) text += "," + quoted(column);
  text += "\n";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i].cell;
    text +=
        fmt::format("{},{},{}", quoted(cell.camera), quoted(cell.trajectory), quoted(cell.method));
    for (const std::string& column : columns) {
      const auto it = rows[i].find(column);
      text += "," + (it == rows[i].end() ? std::string() : it->second);
    }
    text += "\n";
  }
  return text;
}

}  // namespace rugae
