#pragma once
// Axes: settings of a study file that take several values, and every combination of them.

#include <string>
#include <vector>

#include "core/yaml.h"

namespace rugae {

/// A setting by its path in the study file, such as recon.keyframes.mean_flow_px, and its value as
/// it would stand there.
struct Setting {
  std::string path, value;
  bool operator==(const Setting&) const = default;
};

struct Axis {
  std::string path;
  std::vector<std::string> values;
  std::string where;  // file:line:column of the values
};

/// The mapping of paths to lists under `axes`, in the file's order; none where the key is absent.
/// Throws Error for a path outside render, recon, scene, resolution and frames, and for a list that
/// is empty or names a value twice.
std::vector<Axis> read_axes(YamlReader& study);

/// Every combination, the last axis fastest; one without settings where there is no axis.
std::vector<std::vector<Setting>> combinations(const std::vector<Axis>& axes);

/// "recon.preprocess.undistort=false, frames=60"; empty without settings.
std::string shown(const std::vector<Setting>& settings);

}  // namespace rugae
