#include "core/pose_track.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "core/check.h"
#include "core/files.h"

namespace rugae {

std::optional<Rigid3> interpolate(const PoseTrack& track, double time_s) {
  if (track.empty() || !(time_s >= track.front().time_s) || !(time_s <= track.back().time_s))
    return std::nullopt;
  const auto after =
      std::lower_bound(track.begin(), track.end(), time_s,
                       [](const TimedPose& pose, double time) { return pose.time_s < time; });
  if (after == track.begin() || after->time_s == time_s) return after->world_from_camera;
  const auto before = std::prev(after);
  const double fraction = (time_s - before->time_s) / (after->time_s - before->time_s);
  return interpolate(before->world_from_camera, after->world_from_camera, fraction);
}

double length_mm(const PoseTrack& track) {
  double sum = 0.0;
  for (std::size_t i = 1; i < track.size(); ++i)
    sum += (track[i].world_from_camera.translation - track[i - 1].world_from_camera.translation)
               .norm();
  return sum;
}

PoseTrack read_tum(const std::filesystem::path& file) {
  std::istringstream text(read_text(file));
  PoseTrack track;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    std::istringstream words(line);
    std::array<double, 8> v{};
    std::string word;
    std::size_t count = 0;
    while (words >> word) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      check(*end == '\0' && std::isfinite(value), "{}:{}: '{}' is not a finite number",
            file.string(), number, word);
      if (count < v.size()) v[count] = value;
      ++count;
    }
    check(count == v.size(), "{}:{}: {} values, expected 8 (time tx ty tz qx qy qz qw)",
          file.string(), number, count);
    const Quat q(v[7], v[4], v[5], v[6]);
    constexpr double kUnitNorm = 1e-3;  // people write three digits
    check(std::abs(q.norm() - 1.0) <= kUnitNorm, "{}:{}: quaternion of norm {}, expected 1",
          file.string(), number, q.norm());
    check(track.empty() || v[0] > track.back().time_s, "{}:{}: time {} does not ascend",
          file.string(), number, v[0]);
    track.push_back({v[0], Rigid3(q.normalized(), Vec3(v[1], v[2], v[3]))});
  }
  return track;
}

std::string tum_text(const PoseTrack& track) {
  std::string text = "# time_s tx ty tz qx qy qz qw: world_from_camera, mm\n";
  for (const TimedPose& pose : track) {
    const Vec3& t = pose.world_from_camera.translation;
    const Quat& q = pose.world_from_camera.rotation;
    text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n",
                        pose.time_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

}  // namespace rugae
