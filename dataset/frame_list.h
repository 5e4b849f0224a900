#pragma once
// frames.csv of the observations: when each frame was taken, and how long and how strongly exposed.

#include <filesystem>
#include <string>
#include <vector>

namespace rugae {

struct FrameRecord {
  double time_s = 0.0;
  double exposure_s = 0.0;
  double gain = 1.0;
};

/// "index,time_s,exposure_s,gain" and one line a frame, with 17 significant digits.
std::string frame_list_text(const std::vector<FrameRecord>& frames);
/// Adds the line of frame `index` to a file of such lines.
void append_frame(const std::filesystem::path& file, int index, const FrameRecord& frame);
/// Throws Error with file and line: a malformed line, an index out of order, times that do not
/// ascend, a value that is not finite.
std::vector<FrameRecord> read_frame_list(const std::filesystem::path& file);

}  // namespace rugae
