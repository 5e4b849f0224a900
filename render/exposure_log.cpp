#include "render/exposure_log.h"

#include <cerrno>
#include <cstring>
#include <sstream>

#include "core/check.h"
#include "core/files.h"
#include "dataset/frame_list.h"
#include "dataset/layout.h"

namespace rugae {
namespace {

std::filesystem::path log_of(const std::filesystem::path& root) {
  return temporary_for(root / "exposures.csv");
}

}  // namespace

std::map<int, FrameExposure> ExposureLog::read(const std::filesystem::path& root) {
  std::map<int, FrameExposure> known;
  const DatasetLayout layout{root};
  if (std::filesystem::exists(layout.frame_list())) {
    const auto records = read_frame_list(layout.frame_list());
    for (std::size_t i = 0; i < records.size(); ++i)
      known[static_cast<int>(i)].used = {records[i].exposure_s, records[i].gain};
    return known;
  }
  if (!std::filesystem::exists(log_of(root))) return known;
  std::istringstream lines(read_text(log_of(root)));
  for (std::string line; std::getline(lines, line) && !lines.eof();) {
    int frame = 0;
    Exposure used, metered;
    if (std::sscanf(line.c_str(), "%d,%la,%la,%la,%la;", &frame, &used.time_s, &used.gain,
                    &metered.time_s, &metered.gain) == 5)
      known[frame] = {used, metered};
  }
  return known;
}

ExposureLog::ExposureLog(const std::filesystem::path& root,
                         const std::map<int, FrameExposure>& known)
    : path_(log_of(root)) {
  if (std::filesystem::exists(DatasetLayout{root}.frame_list())) return;
  file_.reset(std::fopen(path_.c_str(), "w"));
  check(file_ != nullptr, "{}: cannot be written: {}", path_.string(), std::strerror(errno));
  for (const auto& [frame, exposure] : known) add(frame, exposure);
}

void ExposureLog::add(int frame, const FrameExposure& exposure) {
  if (!file_) return;
  // Hexadecimal, so that reading gives back the same doubles.
  const auto& [used, metered] = exposure;
  const int written = std::fprintf(file_.get(), "%d,%a,%a,%a,%a;\n", frame, used.time_s, used.gain,
                                   metered.time_s, metered.gain);
  check(written > 0 && std::fflush(file_.get()) == 0, "{}: cannot be written: {}", path_.string(),
        std::strerror(errno));
}

}  // namespace rugae
