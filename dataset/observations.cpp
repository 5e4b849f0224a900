#include "dataset/observations.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/check.h"
#include "core/files.h"
#include "dataset/frame_list.h"
#include "dataset/image_io.h"

namespace rugae {
namespace fs = std::filesystem;

// Runs of digits compare as numbers, everything else byte by byte: "f2.png" before "f10.png".
bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](const std::string& s, std::size_t i) {
    return i < s.size() && std::isdigit(static_cast<unsigned char>(s[i])) != 0;
  };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a, i) && digit(b, j)) {
      while (i < a.size() && a[i] == '0') ++i;
      while (j < b.size() && b[j] == '0') ++j;
      std::size_t m = i, n = j;
      while (digit(a, m)) ++m;
      while (digit(b, n)) ++n;
      if (m - i != n - j) return m - i < n - j;
      const int order = a.compare(i, m - i, b, j, n - j);
      if (order != 0) return order < 0;
      i = m;
      j = n;
    } else {
      if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      ++i;
      ++j;
    }
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;  // "f01" and "f1" differ only in zeros
}

namespace {

struct Source {
  std::vector<fs::path> files;
  std::vector<double> times_s;
  fs::path calibration;
};

// The folder's parts by the layout of a dataset; truth is neither looked for nor named here.
Source of_dataset(const fs::path& folder, const fs::path& observations) {
  Source source;
  const fs::path list = observations / "frames.csv";
  check(fs::exists(list), "{}: the dataset was not finished (no {}); run the simulation again",
        folder.string(), fs::relative(list, folder).string());
  for (const FrameRecord& record : read_frame_list(list)) {
    const fs::path frames = observations / "frames";
    const std::string name = fmt::format("{:06}", source.files.size());
    const fs::path jpeg = frames / (name + ".jpg"), png = frames / (name + ".png");
    source.files.push_back(fs::exists(jpeg) ? jpeg : png);
    check(fs::exists(source.files.back()), "{}: missing", source.files.back().string());
    source.times_s.push_back(record.time_s);
  }
  source.calibration = observations / "calibration.yaml";
  return source;
}

Source of_images(const fs::path& folder, double fps) {
  Source source;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && has_image_extension(entry.path()))
      source.files.push_back(entry.path());
  check(!source.files.empty(), "{}: no images (PNG, JPEG or BMP) in this folder", folder.string());
  std::ranges::sort(source.files, [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  check(fps > 0.0, "fps is {}, expected above 0", fps);
  for (std::size_t i = 0; i < source.files.size(); ++i)
    source.times_s.push_back(static_cast<double>(i) / fps);
  source.calibration = folder / "calibration.yaml";
  return source;
}

// All rows are read before those of the next frame.
void check_row_time(double row_time_s, int rows, double frame_s, const fs::path& file) {
  constexpr double kRounding = 1.001;  // of times and row times in files
  check(row_time_s * rows <= kRounding * frame_s,
        "{}: row_time_us is {}, {} rows take {:.3g} s, but frames are {:.3g} s apart",
        file.string(), 1e6 * row_time_s, rows, row_time_s * rows, frame_s);
}

double row_time_s_of(const Calibration& calibration) {
  return 1e-6 * calibration.row_time_us.value_or(0.0);
}

}  // namespace

Observations Observations::open(const fs::path& folder, const fs::path& calibration, double fps) {
  check(fs::exists(folder), "{}: no such folder", folder.string());
  check(fs::is_directory(folder), "{}: is a file, expected a folder", folder.string());
  Source source;
  if (fs::is_directory(folder / "observations"))
    source = of_dataset(folder, folder / "observations");
  else if (fs::is_directory(folder / "frames"))
    source = of_dataset(folder, folder);
  else
    source = of_images(folder, fps);
  check(source.files.size() >= 2, "{}: {} usable frame{}, at least two are needed", folder.string(),
        source.files.size(), source.files.size() == 1 ? "" : "s");
  const fs::path own = source.calibration;
  if (!calibration.empty()) source.calibration = calibration;
  check(!calibration.empty() || fs::exists(source.calibration),
        "{}: no calibration for these images; give one with --calibration", folder.string());

  Observations observations;
  Calibration chosen = load_calibration(source.calibration);
  if (source.calibration != own && fs::exists(own)) {
    const Calibration of_dataset = load_calibration(own);
    if (!chosen.row_time_us) chosen.row_time_us = of_dataset.row_time_us;
    if (!chosen.lights) chosen.lights = of_dataset.lights;
  }
  observations.lights_ = chosen.lights.value_or(std::vector<Emitter>{});
  observations.lens_ = chosen.lens;
  observations.row_time_s_ = row_time_s_of(chosen);
  check_row_time(observations.row_time_s_, chosen.lens.height,
                 (source.times_s.back() - source.times_s.front()) /
                     (static_cast<double>(source.times_s.size()) - 1.0),
                 source.calibration);
  observations.files_ = std::move(source.files);
  observations.times_s_ = std::move(source.times_s);
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  observations.name_ =
      (absolute.has_filename() ? absolute : absolute.parent_path()).filename().string();
  (void)observations.image(0);  // its size against the lens, before work begins
  return observations;
}

Observations Observations::record(const fs::path& folder, const Calibration& calibration) {
  check(!fs::exists(folder / "frames.csv") && !fs::exists(folder / "frames"),
        "{}: has frames already, expected a folder to record into", folder.string());
  make_folder(folder / "frames");
  write_atomic(folder / "calibration.yaml", calibration_yaml(calibration, "as it was recorded"));
  write_atomic(folder / "frames.csv", frame_list_text({}));
  Observations observations;
  observations.recording_ = folder;
  observations.name_ = fs::absolute(folder).lexically_normal().filename().string();
  observations.lens_ = calibration.lens;
  observations.row_time_s_ = row_time_s_of(calibration);
  observations.lights_ = calibration.lights.value_or(std::vector<Emitter>{});
  return observations;
}

void Observations::append(const cv::Mat& bgr, double time_s) {
  check(!recording_.empty(), "{}: is not being recorded", name_);
  check(bgr.type() == CV_8UC3 && bgr.cols == lens_.width && bgr.rows == lens_.height,
        "{}: frame {} is {} x {} px of type {}, expected {} x {} px, 8-bit BGR",
        recording_.string(), size(), bgr.cols, bgr.rows, bgr.type(), lens_.width, lens_.height);
  if (times_s_.empty()) {
    check(std::isfinite(time_s), "{}: frame 0 is at {} s", recording_.string(), time_s);
  } else {
    check(std::isfinite(time_s) && time_s > times_s_.back(),
          "{}: frame {} is at {} s, expected after {} s", recording_.string(), size(), time_s,
          times_s_.back());
    check_row_time(row_time_s_, lens_.height, time_s - times_s_.back(), recording_);
  }
  const fs::path file = recording_ / "frames" / fmt::format("{:06}.png", size());
  write_image(file, bgr);
  append_frame(recording_ / "frames.csv", size(), {time_s, 0.0, 1.0});  // exposure is not known
  files_.push_back(file);
  times_s_.push_back(time_s);
}

cv::Mat Observations::image(int index) const {
  cv::Mat image = read_image_bgr(files_.at(static_cast<std::size_t>(index)));
  check(image.cols == lens_.width && image.rows == lens_.height,
        "{}: image of {} x {} px, the calibration is for {} x {}",
        files_[static_cast<std::size_t>(index)].string(), image.cols, image.rows, lens_.width,
        lens_.height);
  return image;
}

}  // namespace rugae
