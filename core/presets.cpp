#include "core/presets.h"

#include <algorithm>
#include <cstdlib>

#include "core/check.h"

namespace rugae {
namespace fs = std::filesystem;

fs::path preset_root() {
  if (const char* home = std::getenv("RUGAE_HOME")) return home;
  return RUGAE_SOURCE_DIR;
}

std::vector<std::string> preset_names(const std::string& kind) {
  const fs::path folder = preset_root() / kind / "presets";
  check(fs::is_directory(folder), "{}: no such folder of presets; RUGAE_HOME names its root",
        folder.string());
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

bool is_path(const std::string& name_or_path) {
  return fs::path(name_or_path).has_extension() || name_or_path.find('/') != std::string::npos;
}

std::string here_or_beside(const std::string& name_or_path, const fs::path& file) {
  if (!is_path(name_or_path) || fs::exists(name_or_path)) return name_or_path;
  const fs::path beside = fs::absolute(file.parent_path() / name_or_path).lexically_normal();
  return fs::exists(beside) ? beside.string() : name_or_path;
}

fs::path find_preset(const std::string& kind, const std::string& what,
                     const std::string& name_or_path) {
  const fs::path path(name_or_path);
  if (is_path(name_or_path)) {
    check(fs::exists(path), "{} '{}': no such file", what, name_or_path);
    return path;
  }
  const auto names = preset_names(kind);
  check(std::ranges::count(names, name_or_path) > 0, "{} '{}': no such preset{}; known: {}", what,
        name_or_path, did_you_mean(name_or_path, names), fmt::join(names, ", "));
  return preset_root() / kind / "presets" / (name_or_path + ".yaml");
}

}  // namespace rugae
