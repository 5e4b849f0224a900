#pragma once
// Axes: settings of a study file that take several values, and every combination of them.

#include <string>
#include <vector>

#include "core/yaml.h"

namespace rugae {

/// A value at a path of the study file, such as recon.keyframes.mean_flow_px, as it would stand
/// there: a word or a number, or a mapping or list in flow style.
struct Change {
  std::string path, value;
};

/// A value of an axis: what people call the two, and what it changes in the file.
struct Setting {
  std::string path, value;
  std::vector<Change> changes = {};
  /// By what they are called.
  bool operator==(const Setting& other) const { return path == other.path && value == other.value; }
};

struct Axis {
  std::string path;
  std::vector<Setting> values;
  std::string where;  // file:line:column of the values

  std::vector<std::string> names() const;  // of the values
};

/// The mapping under `axes`, in the file's order; none where the key is absent. An axis is a path
/// with the list of its values, or a name of its own with a mapping of names to changes, where each
/// value changes several things at once. Throws Error for a path outside what a cell is made with,
/// and for a list that is empty or names a value twice.
std::vector<Axis> read_axes(YamlReader& study);

/// The keys of `key`, each a path, and their values; throws Error as read_axes().
std::vector<Change> read_changes(YamlReader& yaml, const std::string& key);

/// Every combination, the last axis fastest; one without settings where there is no axis.
std::vector<std::vector<Setting>> combinations(const std::vector<Axis>& axes);

/// "recon.preprocess.undistort=false, frames=60"; empty without settings.
std::string shown(const std::vector<Setting>& settings);

}  // namespace rugae
