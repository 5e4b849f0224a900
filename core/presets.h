#pragma once
// Presets are YAML files in <folder>/presets; a name or a path names one.

#include <filesystem>
#include <string>
#include <vector>

namespace rugae {

/// The root under which the folders cameras/presets, scenes/presets, ... are found: the environment
/// variable RUGAE_HOME, else the source tree the library was built from.
std::filesystem::path preset_root();

/// Names (file stems) of the presets of a kind ("cameras", "scenes", "trajectories", "studies"),
/// sorted.
std::vector<std::string> preset_names(const std::string& kind);

/// True for what has an extension or a slash.
bool is_path(const std::string& name_or_path);
/// A path that `file` names: as it is where it exists, else beside `file` where that exists. A name
/// stays as it is.
std::string here_or_beside(const std::string& name_or_path, const std::filesystem::path& file);

/// The file of a preset name, or the path itself when `name_or_path` is one.
/// Throws Error for an unknown name: "camera 'misumi-v550': no such preset; did you mean
/// 'misumi-v5506'?" (`what` is "camera").
std::filesystem::path find_preset(const std::string& kind, const std::string& what,
                                  const std::string& name_or_path);

}  // namespace rugae
