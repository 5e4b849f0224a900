#include "studies/axes.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/check.h"

namespace rugae {
namespace {

// What a cell is made with, and can so be changed from cell to cell.
const std::vector<std::string> kSections = {"render",     "recon",  "scene", "camera",
                                            "resolution", "frames", "first", "calibrate",
                                            "lens_error", "replace"};

std::string first_key(const std::string& path) { return path.substr(0, path.find('.')); }

bool has_own_list(const std::string& key) {
  return key == "cameras" || key == "trajectories" || key == "methods" || key == "seed" ||
         key == "seeds";
}

void check_path(const std::string& path, const std::string& where) {
  const std::string first = first_key(path);
  check(!has_own_list(first),
        "{}: axis '{}': cameras, trajectories, methods and seeds have lists of their own", where,
        path);
  check(std::ranges::count(kSections, first) > 0,
        "{}: axis '{}': no such setting, expected one of: {}{}", where, path,
        fmt::join(kSections, ", "), did_you_mean(first, kSections));
}

Axis read_list(YamlReader& axes, const std::string& path) {
  Axis axis{path, {}, axes.where(path)};
  check_path(path, axis.where);
  for (const std::string& value : axes.texts(path))
    axis.values.push_back({path, value, {{path, value}}});
  return axis;
}

Axis read_bundles(YamlReader& axes, const std::string& name) {
  Axis axis{name, {}, axes.where(name)};
  const bool setting = std::ranges::count(kSections, first_key(name)) > 0;
  check(!setting && !has_own_list(name),
        "{}: axis '{}' is a mapping, expected a list of its values; only an axis with a name of "
        "its own has names for its values",
        axis.where, name);
  auto values = axes.child(name);
  for (const std::string& value : values->keys())
    axis.values.push_back({name, value, read_changes(*values, value)});
  return axis;
}

}  // namespace

std::vector<std::string> Axis::names() const {
  std::vector<std::string> all;
  for (const Setting& s : values) all.push_back(s.value);
  return all;
}

std::vector<Change> read_changes(YamlReader& yaml, const std::string& key) {
  std::vector<Change> changes;
  auto mapping = yaml.child(key);
  if (!mapping) return changes;
  for (const std::string& path : mapping->keys()) {
    check_path(path, mapping->where(path));
    changes.push_back({path, mapping->text(path)});
  }
  return changes;
}

std::vector<Axis> read_axes(YamlReader& study) {
  std::vector<Axis> axes;
  auto yaml = study.child("axes");
  if (!yaml) return axes;
  for (const std::string& path : yaml->keys()) {
    Axis axis = yaml->has_mapping(path) ? read_bundles(*yaml, path) : read_list(*yaml, path);
    check(!axis.values.empty(), "{}: axis '{}' is empty, expected at least one value", axis.where,
          path);
    for (const Setting& value : axis.values)
      check(std::ranges::count(axis.values, value) == 1, "{}: axis '{}': {} stands twice",
            axis.where, path, value.value);
    axes.push_back(std::move(axis));
  }
  return axes;
}

std::vector<std::vector<Setting>> combinations(const std::vector<Axis>& axes) {
  std::vector<std::vector<Setting>> all = {{}};
  for (const Axis& axis : axes) {
    std::vector<std::vector<Setting>> longer;
    for (const auto& settings : all)
      for (const Setting& value : axis.values) {
        longer.push_back(settings);
        longer.back().push_back(value);
      }
    all = std::move(longer);
  }
  return all;
}

std::string shown(const std::vector<Setting>& settings) {
  std::string text;
  for (const Setting& s : settings) text += (text.empty() ? "" : ", ") + s.path + "=" + s.value;
  return text;
}

}  // namespace rugae
