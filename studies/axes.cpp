#include "studies/axes.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/check.h"

namespace rugae {
namespace {

const std::vector<std::string> kSections = {"render", "recon", "scene", "resolution", "frames"};

void check_path(const Axis& axis) {
  const std::string first = axis.path.substr(0, axis.path.find('.'));
  const bool own_list = first == "cameras" || first == "trajectories" || first == "methods" ||
                        first == "seed" || first == "seeds";
  check(!own_list,
        "{}: axis '{}': cameras, trajectories, methods and seeds have lists of their own",
        axis.where, axis.path);
  check(std::ranges::count(kSections, first) > 0,
        "{}: axis '{}': no such setting, expected one of: {}{}", axis.where, axis.path,
        fmt::join(kSections, ", "), did_you_mean(first, kSections));
}

}  // namespace

std::vector<Axis> read_axes(YamlReader& study) {
  std::vector<Axis> axes;
  auto yaml = study.child("axes");
  if (!yaml) return axes;
  for (const std::string& path : yaml->keys()) {
    Axis axis{path, {}, yaml->where(path)};
    check_path(axis);
    yaml->get(path, axis.values);
    check(!axis.values.empty(), "{}: axis '{}' is empty, expected at least one value", axis.where,
          path);
    for (const std::string& value : axis.values)
      check(std::ranges::count(axis.values, value) == 1, "{}: axis '{}': {} stands twice",
            axis.where, path, value);
    axes.push_back(std::move(axis));
  }
  return axes;
}

std::vector<std::vector<Setting>> combinations(const std::vector<Axis>& axes) {
  std::vector<std::vector<Setting>> all = {{}};
  for (const Axis& axis : axes) {
    std::vector<std::vector<Setting>> longer;
    for (const auto& settings : all)
      for (const std::string& value : axis.values) {
        longer.push_back(settings);
        longer.back().push_back({axis.path, value});
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
