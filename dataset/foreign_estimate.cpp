#include "dataset/foreign_estimate.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "dataset/image_io.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

// Of the time between frames, that a pose's time may be off: times are often written in ms.
constexpr double kTimeShare = 0.05;

// The frame whose time is that of the pose.
std::size_t frame_at(double time_s, const std::vector<double>& times_s, const fs::path& file) {
  const auto distance = [time_s](double t) { return std::abs(t - time_s); };
  const auto nearest = std::ranges::min_element(times_s, {}, distance);
  const double step_s = times_s.size() > 1 ? (times_s.back() - times_s.front()) /
                                                 static_cast<double>(times_s.size() - 1)
                                           : 1.0;
  check(distance(*nearest) <= kTimeShare * step_s,
        "{}: a pose at {} s, expected the times of frames to within {:.2g} s, the nearest is {} s",
        file.string(), time_s, kTimeShare * step_s, *nearest);
  return static_cast<std::size_t>(nearest - times_s.begin());
}

// The only run of digits in a name.
int number_in(const fs::path& file) {
  const std::string name = file.stem().string();
  const auto digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  const auto first = std::ranges::find_if(name, digit);
  const auto last = std::find_if_not(first, name.end(), digit);
  const auto digits = last - first;
  constexpr int kMostDigits = 9;
  check(digits > 0 && digits <= kMostDigits && std::find_if(last, name.end(), digit) == name.end(),
        "{}: expected one number in the name, its frame's", file.string());
  return std::stoi(std::string(first, last));
}

}  // namespace

Estimate estimate_of_trajectory(const fs::path& file, const std::vector<double>& times_s,
                                double mm_per_unit) {
  Estimate e;
  e.times_s = times_s;
  e.states.assign(times_s.size(), FrameState::lost);
  e.world_from_camera.assign(times_s.size(), Rigid3{});
  for (const TimedPose& pose : read_tum(file)) {
    const std::size_t frame = frame_at(pose.time_s, times_s, file);
    check(e.states[frame] == FrameState::lost, "{}: two poses at {} s", file.string(), pose.time_s);
    e.states[frame] = FrameState::resected;
    e.world_from_camera[frame] = {pose.world_from_camera.rotation,
                                  mm_per_unit * pose.world_from_camera.translation};
  }
  return e;
}

cv::Mat read_foreign_depth_mm(const fs::path& file, double mm_per_unit) {
  cv::Mat depth;
  if (has_image_extension(file)) {
    depth = read_image_as_stored(file);
    check(depth.type() == CV_16UC1, "{}: depth is stored as {}, expected 16-bit of one channel",
          file.string(), cv::typeToString(depth.type()));
  } else {
    depth = read_any_exr(file);
    if (depth.channels() > 1) cv::extractChannel(depth, depth, 0);
  }
  depth.convertTo(depth, CV_32F, mm_per_unit);
  return depth;
}

std::map<int, fs::path> foreign_depth_files(const fs::path& folder, int frames) {
  check(fs::is_directory(folder), "{}: no such folder", folder.string());
  std::map<int, fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& file = entry.path();
    const std::string extension = lower_extension(file);
    if (extension != ".exr" && extension != ".png") continue;
    const int frame = number_in(file);
    check(frame < frames, "{}: frame {}, the dataset has 0 to {}", file.string(), frame,
          frames - 1);
    const auto [place, is_new] = files.try_emplace(frame, file);
    check(is_new, "{}: frame {} has {}, too", file.string(), frame,
          place->second.filename().string());
  }
  check(!files.empty(), "{}: no files .exr, .png in this folder", folder.string());
  return files;
}

}  // namespace rugae
