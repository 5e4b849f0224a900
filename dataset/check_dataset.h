#pragma once
// `rugae check`: is this dataset whole and consistent?

#include <filesystem>
#include <string>
#include <vector>

namespace rugae {

struct DatasetCheck {
  std::vector<std::string> problems;  // one line each, naming the file; empty means sound
  std::vector<std::string> notes;     // what could not be compared, one line each
  int frames = 0;
  std::size_t files = 0;
  /// Largest disagreement of the flow with depth and pose over all sampled pixels of all frames,
  /// px; -1 when there was nothing to compare.
  double worst_flow_px = -1.0;
  std::size_t flow_samples = 0;
};

/// Checks the manifest (missing, extra and changed files), that images decode and agree in size,
/// counts, that poses are finite rotations that move, that labels keep what the masks promise, and
/// that depth, pose and flow agree on sampled pixels: the pixel lifted by its depth, moved by the
/// poses and projected into the next frame must be where the flow says, to 0.01 px, and to
/// 0.001 px in the median. Where they
/// disagree, the common mistakes are tried (a label shifted by one frame, a flipped sign, inverted
/// poses) and the one that fits is named. Throws Error when `root` is not a dataset's folder.
DatasetCheck check_dataset(const std::filesystem::path& root);

}  // namespace rugae
