#include "dataset/frame_list.h"

#include "core/check.h"
#include "dataset/csv.h"

namespace rugae {
namespace {
constexpr const char* kHeader = "index,time_s,exposure_s,gain";
}  // namespace

std::string frame_list_text(const std::vector<FrameRecord>& frames) {
  std::string text = std::string(kHeader) + "\n";
  for (std::size_t i = 0; i < frames.size(); ++i)
    text += fmt::format("{},{:.17g},{:.17g},{:.17g}\n", i, frames[i].time_s, frames[i].exposure_s,
                        frames[i].gain);
  return text;
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
