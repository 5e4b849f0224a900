#include "validate/pose_error.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace rugae {
namespace {

constexpr double kSameTime_s = 1e-6;  // times pass through text with 17 digits

Rigid3 scaled(const Rigid3& pose, double scale) {
  return {pose.rotation, scale * pose.translation};
}

// The estimate at each pose of the truth, empty where no estimated pose has its time.
std::vector<std::optional<Rigid3>> by_frame(const PoseTrack& truth, const PoseTrack& estimate) {
  std::vector<std::optional<Rigid3>> poses(truth.size());
  std::size_t i = 0;
  for (const TimedPose& pose : estimate) {
    while (i < truth.size() && truth[i].time_s < pose.time_s - kSameTime_s) ++i;
    if (i < truth.size() && std::abs(truth[i].time_s - pose.time_s) <= kSameTime_s)
      poses[i] = pose.world_from_camera;
  }
  return poses;
}

}  // namespace

std::optional<AbsoluteError> absolute_error(const TrackPair& pair, Alignment alignment) {
  const std::optional<Sim3> aligned = align_tracks(pair, alignment);
  if (!aligned) return std::nullopt;
  AbsoluteError error;
  error.truth_from_estimate = *aligned;
  for (std::size_t i = 0; i < pair.size(); ++i) {
    const Rigid3 pose = *aligned * pair.estimate[i];
    error.position_of_pose_mm.push_back((pose.translation - pair.truth[i].translation).norm());
    error.rotation_of_pose_rad.push_back(angle_between_rad(pose.rotation, pair.truth[i].rotation));
  }
  error.position_mm = error_stats(error.position_of_pose_mm);
  error.rotation_rad = error_stats(error.rotation_of_pose_rad);
  return error;
}

RelativeError relative_error(const std::vector<Rigid3>& truth,
                             const std::vector<std::optional<Rigid3>>& estimate, double scale,
                             const std::vector<int>& end_of_step) {
  check(truth.size() == estimate.size() && truth.size() == end_of_step.size(),
        "relative_error: {} true poses, {} estimated, {} steps", truth.size(), estimate.size(),
        end_of_step.size());
  RelativeError error;
  std::vector<double> translation_mm, rotation_rad;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const int j = end_of_step[i];
    if (j < 0) continue;
    ++error.possible;
    if (!estimate[i] || !estimate[j]) continue;
    const Rigid3 true_motion = truth[i].inverse() * truth[j];
    const Rigid3 motion = scaled(*estimate[i], scale).inverse() * scaled(*estimate[j], scale);
    const Rigid3 difference = true_motion.inverse() * motion;
    translation_mm.push_back(difference.translation.norm());
    rotation_rad.push_back(angle_between_rad(true_motion.rotation, motion.rotation));
  }
  error.translation_mm = error_stats(translation_mm);
  error.rotation_rad = error_stats(rotation_rad);
  return error;
}

std::vector<int> steps_of_frames(std::size_t poses, int frames) {
  std::vector<int> ends(poses, -1);
  for (std::size_t i = 0; i + frames < poses; ++i) ends[i] = static_cast<int>(i) + frames;
  return ends;
}

std::vector<int> steps_of_time(const PoseTrack& truth, double seconds) {
  std::vector<int> ends(truth.size(), -1);
  if (truth.size() < 2) return ends;
  const double frame_s = (truth.back().time_s - truth.front().time_s) / (truth.size() - 1.0);
  std::size_t j = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double wanted_s = truth[i].time_s + seconds;
    const auto gap_s = [&](std::size_t k) { return std::abs(truth[k].time_s - wanted_s); };
    while (j + 1 < truth.size() && gap_s(j + 1) <= gap_s(j)) ++j;
    if (j > i && gap_s(j) <= 0.5 * frame_s + kSameTime_s) ends[i] = static_cast<int>(j);
  }
  return ends;
}

std::vector<int> steps_of_path(const PoseTrack& truth, double path_mm) {
  std::vector<double> along_mm(truth.size(), 0.0);
  for (std::size_t i = 1; i < truth.size(); ++i)
    along_mm[i] = along_mm[i - 1] + (truth[i].world_from_camera.translation -
                                     truth[i - 1].world_from_camera.translation)
                                        .norm();
  std::vector<int> ends(truth.size(), -1);
  constexpr double kRounding_mm = 1e-9;  // of the running sum: a frame every 10 mm is a step
  std::size_t j = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    while (j < truth.size() && along_mm[j] - along_mm[i] < path_mm - kRounding_mm) ++j;
    if (j < truth.size()) ends[i] = static_cast<int>(j);
  }
  return ends;
}

PoseErrors pose_errors(const PoseTrack& truth, const PoseTrack& estimate) {
  PoseErrors errors;
  errors.frames = static_cast<int>(truth.size());
  errors.length_mm = length_mm(truth);
  const TrackPair pair = associate(truth, estimate);
  const std::vector<std::optional<Rigid3>> poses = by_frame(truth, estimate);
  errors.tracked = static_cast<int>(
      std::ranges::count_if(poses, [](const auto& pose) { return pose.has_value(); }));
  if (errors.frames > 0) errors.tracked_share = static_cast<double>(errors.tracked) / errors.frames;
  errors.se3 = absolute_error(pair, Alignment::se3);
  errors.sim3 = absolute_error(pair, Alignment::sim3);
  if (!errors.sim3) {
    errors.note = errors.tracked < 3
                      ? fmt::format("{} of {} frames tracked: an alignment needs 3", errors.tracked,
                                    errors.frames)
                      : fmt::format(
                            "the {} tracked positions lie on one line or in one place: no "
                            "alignment is determined",
                            errors.tracked);
    return errors;
  }
  std::vector<Rigid3> true_poses;
  for (const TimedPose& pose : truth) true_poses.push_back(pose.world_from_camera);
  const double scale = errors.sim3->truth_from_estimate.scale;
  errors.per_frame = relative_error(true_poses, poses, scale, steps_of_frames(truth.size(), 1));
  errors.per_second = relative_error(true_poses, poses, scale, steps_of_time(truth, 1.0));
  errors.per_10mm = relative_error(true_poses, poses, scale, steps_of_path(truth, 10.0));
  return errors;
}

}  // namespace rugae
