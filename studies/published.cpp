#include "studies/published.h"

#include <charconv>
#include <cmath>
#include <map>

#include "core/check.h"
#include "core/presets.h"
#include "core/yaml.h"

namespace rugae {
namespace {

struct Table {
  std::string source;
  std::map<std::pair<std::string, std::string>, double> numbers;  // of row and column
};
struct Published {
  std::map<std::string, std::string> cameras;
  std::map<std::string, Table> tables;
};

Table read_table(YamlReader yaml) {
  Table table;
  double scale = 1.0;
  std::vector<std::string> columns;
  yaml.require("source", table.source);
  yaml.get("scale", scale);
  yaml.require("columns", columns);
  auto rows = yaml.child("rows");
  for (const std::string& row : rows->keys()) {
    const std::vector<std::string> numbers = rows->texts(row);
    check(numbers.size() == columns.size(), "{}: {} numbers, expected one for each of {} columns",
          rows->where(row), numbers.size(), columns.size());
    for (std::size_t i = 0; i < columns.size(); ++i)
      if (const auto number = number_in(numbers[i]))
        table.numbers[{row, columns[i]}] = scale * *number;
  }
  yaml.finish();
  return table;
}

Published read_published() {
  Published all;
  YamlReader yaml = YamlReader::from_file(preset_root() / "studies" / "published.yaml");
  auto cameras = yaml.child("cameras");
  for (const std::string& preset : cameras->keys()) cameras->get(preset, all.cameras[preset]);
  auto tables = yaml.child("tables");
  for (const std::string& name : tables->keys())
    all.tables[name] = read_table(*tables->child(name));
  yaml.finish();
  return all;
}

const Published& all_published() {
  static const Published all = read_published();
  return all;
}

}  // namespace

std::vector<std::string> published_tables() {
  std::vector<std::string> names;
  for (const auto& [name, table] : all_published().tables) names.push_back(name);
  return names;
}

std::optional<double> published(const std::string& table, const std::string& row,
                                const std::string& column) {
  const auto& tables = all_published().tables;
  const auto at = tables.find(table);
  if (at == tables.end()) return std::nullopt;
  const auto number = at->second.numbers.find({row, column});
  return number == at->second.numbers.end() ? std::nullopt : std::optional(number->second);
}

std::string published_source(const std::string& table) {
  const auto& tables = all_published().tables;
  const auto at = tables.find(table);
  return at == tables.end() ? std::string() : at->second.source;
}

std::string published_camera(const std::string& camera) {
  const auto& cameras = all_published().cameras;
  const auto at = cameras.find(camera);
  return at == cameras.end() ? camera : at->second;
}

std::optional<double> number_in(const std::string& text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number))
    return std::nullopt;
  return number;
}

}  // namespace rugae
