#pragma once
// `rugae check`: is this dataset whole and consistent?

#include <filesystem>
#include <string>
#include <vector>

namespace rugae {

struct DatasetCheck {
  std::vector<std::string> problems;  // one line each; empty means sound
  int frames = 0;
  std::size_t files = 0;
};

/// Checks the manifest (missing, extra and changed files), that images decode and agree in size,
/// counts, that poses are finite rotations that move, and that depth, pose and flow agree on
/// sampled pixels (reprojection of depth to the next frame against the flow).
DatasetCheck check_dataset(const std::filesystem::path& root);

}  // namespace rugae
