#include "dataset/frame_list.h"

#include <fstream>

#include "core/check.h"
#include "dataset/csv.h"

namespace rugae {
namespace {
constexpr const char* kHeader = "index,time_s,exposure_s,gain";

std::string line_of(std::size_t index, const FrameRecord& frame) {
  return fmt::format("{},{:.17g},{:.17g},{:.17g}\n", index, frame.time_s, frame.exposure_s,
                     frame.gain);
}

}  // namespace

std::string frame_list_text(const std::vector<FrameRecord>& frames) {
  std::string text = std::string(kHeader) + "\n";
  for (std::size_t i = 0; i < frames.size(); ++i) text += line_of(i, frames[i]);
  return text;
}

void append_frame(const std::filesystem::path& file, int index, const FrameRecord& frame) {
  std::ofstream stream(file, std::ios::app);
  stream << line_of(static_cast<std::size_t>(index), frame) << std::flush;
  check(stream.good(), "{}: cannot be written", file.string());
}

std::vector<FrameRecord> read_frame_list(const std::filesystem::path& file) {
  std::vector<FrameRecord> frames;
  for (const CsvLine& line : read_csv(file, kHeader)) {
    check(csv_number(file, line, 0) == static_cast<double>(frames.size()),
          "{}:{}: index {}, expected {}", file.string(), line.number, line.cells[0], frames.size());
    const FrameRecord frame{csv_number(file, line, 1), csv_number(file, line, 2),
                            csv_number(file, line, 3)};
    check(frames.empty() || frame.time_s > frames.back().time_s, "{}:{}: time {} does not ascend",
          file.string(), line.number, line.cells[1]);
    frames.push_back(frame);
  }
  return frames;
}

}  // namespace rugae
