#include "validate/evaluate.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/check.h"
#include "core/in_lots.h"
#include "core/mesh_io.h"
#include "dataset/foreign_estimate.h"
#include "dataset/image_io.h"
#include "validate/metrics_json.h"
#include "validate/wall_seen.h"

namespace rugae {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr std::size_t kFramesAtOnce = 16;  // whose depth is read side by side

// An estimate and where its depth comes from.
struct Measured {
  Estimate estimate;
  std::string name;                        // for messages
  std::function<cv::Mat(int)> depth = {};  // of a frame, in the estimate's units; empty where none
  bool depth_is_mm = false;                // of a foreign one
};

// The tracked poses at the times of the truth: frames are the same by index, and must be so by
// time.
PoseTrack track_at_true_times(const Truth& truth, const Estimate& estimate,
                              const std::string& name) {
  check(static_cast<int>(estimate.states.size()) == truth.size(),
        "{}: an estimate of {} frames, the dataset has {}", name, estimate.states.size(),
        truth.size());
  PoseTrack track;
  for (int i = 0; i < truth.size(); ++i) {
    const double time_s = truth.track()[i].time_s;
    constexpr double kSameTime_s = 1e-6;
    check(std::abs(estimate.times_s[i] - time_s) <= kSameTime_s,
          "{}: frame {} is at {} s, in the dataset at {} s", name, i, estimate.times_s[i], time_s);
    if (estimate.states[i] != FrameState::lost)
      track.push_back({time_s, estimate.world_from_camera[i]});
  }
  return track;
}

json tracking_json(const PoseErrors& poses, const Estimate& estimate) {
  const auto keyframes = std::ranges::count(estimate.states, FrameState::keyframe);
  return {{"frames", poses.frames},
          {"tracked", poses.tracked},
          {"lost", poses.frames - poses.tracked},
          {"tracked_share", poses.tracked_share},
          {"keyframes", keyframes}};
}

json time_json(const Estimate& estimate) {
  if (estimate.stages.empty())  // of another program: nobody knows
    return {{"reconstruct_s", nullptr},     {"pair_s", nullptr},
            {"frames_per_s", nullptr},      {"path_s", nullptr},
            {"path_frames_per_s", nullptr}, {"peak_rss_mb", nullptr},
            {"stage_s", json::object()},    {"stages", json::array()}};
  json stages = json::array(), stage_s = json::object();
  double seconds = 0.0, peak_mb = 0.0;
  for (const StageTime& stage : estimate.stages) {
    stages.push_back(
        {{"name", stage.name}, {"seconds", stage.seconds}, {"peak_rss_mb", stage.peak_rss_mb}});
    stage_s[stage.name] = stage_s.value(stage.name, 0.0) + stage.seconds;  // some come twice
    seconds += stage.seconds;
    peak_mb = std::max(peak_mb, stage.peak_rss_mb);
  }
  const auto frames = static_cast<double>(estimate.states.size());
  const auto a_second = [frames](double s) { return s > 0.0 ? json(frames / s) : json(); };
  return {{"reconstruct_s", seconds},
          {"pair_s", frames > 1.0 ? json(seconds / (frames - 1.0)) : json()},
          {"frames_per_s", a_second(seconds)},
          {"path_s", estimate.path_s},
          {"path_frames_per_s", a_second(estimate.path_s)},
          {"peak_rss_mb", peak_mb},
          {"stage_s", stage_s},
          {"stages", stages}};
}

json numbers(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// For plots: a value a frame, null where the frame was lost.
json frames_json(const Truth& truth, const Estimate& estimate, const PoseErrors& poses) {
  json time_s = json::array(), position = json::array(), rotation = json::array(),
       true_mm = json::array(), aligned_mm = json::array(), state = json::array();
  std::size_t next = 0;  // of the tracked poses
  const PoseTrack track = estimate.track();
  for (int i = 0; i < truth.size(); ++i) {
    const TimedPose& pose = truth.track()[i];
    time_s.push_back(pose.time_s);
    true_mm.push_back(numbers(pose.world_from_camera.translation));
    const bool tracked = estimate.states[i] != FrameState::lost;
    state.push_back(!tracked                                     ? "lost"
                    : estimate.states[i] == FrameState::keyframe ? "keyframe"
                                                                 : "resected");
    if (tracked && poses.sim3) {
      position.push_back(poses.sim3->position_of_pose_mm.at(next));
      rotation.push_back(poses.sim3->rotation_of_pose_rad.at(next));
      aligned_mm.push_back(
          numbers(poses.sim3->truth_from_estimate * track[next].world_from_camera.translation));
    } else {
      position.push_back(nullptr);
      rotation.push_back(nullptr);
      aligned_mm.push_back(nullptr);
    }
    if (tracked) ++next;
  }
  return {{"time_s", time_s},    {"position_error_mm", position}, {"rotation_error_rad", rotation},
          {"truth_mm", true_mm}, {"estimate_mm", aligned_mm},     {"state", state}};
}

json depth_errors(const Truth& truth, const Measured& measured, const PoseErrors& poses,
                  Progress& progress) {
  struct OfFrame {
    std::optional<DepthError> metric, by_median, as_given;
  };
  std::vector<DepthError> metric, by_median, as_given;
  make_in_lots(
      static_cast<std::size_t>(truth.size()), kFramesAtOnce, progress,
      [&](std::size_t i) {
        OfFrame errors;
        const int frame = static_cast<int>(i);
        const cv::Mat estimated = measured.depth(frame);
        if (estimated.empty()) return errors;
        const cv::Mat true_mm = truth.depth_mm(frame);
        check(estimated.size() == true_mm.size(),
              "{}: depth of frame {} is {} x {}, the frames are {} x {}", measured.name, frame,
              estimated.cols, estimated.rows, true_mm.cols, true_mm.rows);
        if (poses.sim3)
          errors.metric = depth_error(estimated, true_mm, poses.sim3->truth_from_estimate.scale);
        if (const auto scale = median_scale(estimated, true_mm))
          errors.by_median = depth_error(estimated, true_mm, *scale);
        if (measured.depth_is_mm) errors.as_given = depth_error(estimated, true_mm, 1.0);
        return errors;
      },
      [&](std::size_t, const OfFrame& errors) {  // means add up in the order of frames
        if (errors.metric) metric.push_back(*errors.metric);
        if (errors.by_median) by_median.push_back(*errors.by_median);
        if (errors.as_given) as_given.push_back(*errors.as_given);
      });
  json out = {{"sim3", depth_json(mean_of(metric))},
              {"median_scaled", depth_json(mean_of(by_median))}};
  if (measured.depth_is_mm) out["as_given"] = depth_json(mean_of(as_given));
  return out;
}

json coverage_json(const Visibility& visibility) {
  const double wall = visibility.wall_area_mm2();
  const double seen = area_mm2(visibility.seen_wall());
  json out = {{"wall_area_mm2", wall}, {"seen_area_mm2", seen}, {"seen_share", seen / wall}};
  for (const unsigned times : {1u, 3u, 10u}) {
    const double area = visibility.covered_area_mm2(times);
    out[fmt::format("covered_{}_times_area_mm2", times)] = area;
    out[fmt::format("covered_{}_times_share", times)] = area / wall;
  }
  return out;
}

// Of an estimate in mm: how much too long all lengths are, and how well it said it knew.
json scale_json(const Estimate& estimate, const PoseErrors& poses) {
  if (!estimate.scale_sigma_share || !poses.sim3) return nullptr;
  const double error_share = 1.0 / poses.sim3->truth_from_estimate.scale - 1.0;
  return {{"error_share", error_share},
          {"sigma_share", *estimate.scale_sigma_share},
          {"error_over_sigma", std::abs(error_share) / *estimate.scale_sigma_share}};
}

json surface_not_measured(const std::string& note) {
  return {{"trajectory_aligned", nullptr},
          {"icp_aligned", nullptr},
          {"icp_scaled", nullptr},
          {"icp", nullptr},
          {"note", note}};
}

// The map against the wall that was seen: placed by the trajectory, then by ICP from there.
json surface_errors(const Estimate& estimate, const TriangleMesh& seen, const PoseErrors& poses) {
  json out = surface_not_measured("");
  if (seen.empty())
    out["note"] = "no part of the wall was seen";
  else if (estimate.map.empty())
    out["note"] = "the estimate has no map";
  else if (!poses.sim3)
    out["note"] = "the map cannot be placed: " + poses.note;
  if (out["note"] != "") return out;
  const TriangleMesh placed = transformed(estimate.map, poses.sim3->truth_from_estimate);
  const TrueSurface truth(seen);
  out["trajectory_aligned"] = surface_json(truth.error_of(placed));
  constexpr std::size_t kMapPoints = 5'000, kWallPoints = 50'000;  // for ICP alone
  const std::vector<Vec3> of_map = sample_surface(placed, kMapPoints);
  const std::vector<Vec3> of_wall = sample_surface(seen, kWallPoints);
  // Each ICP keeps to one thread (icp.cpp): the two run side by side.
  struct Aligned {
    IcpResult found;
    json error;
  };
  std::array<Aligned, 2> aligned;
  tbb::parallel_for(std::size_t{0}, aligned.size(), [&](std::size_t i) {
    aligned[i].found = icp(of_map, of_wall, {.with_scale = i == 1});
    if (!aligned[i].found.converged) return;
    const Sim3& target_from_source = aligned[i].found.target_from_source;
    aligned[i].error = surface_json(truth.error_of(transformed(placed, target_from_source)));
  });
  if (aligned[0].found.converged) {
    out["icp_aligned"] = aligned[0].error;
    out["icp"] = transform_json(aligned[0].found.target_from_source);
  }
  if (aligned[1].found.converged) out["icp_scaled"] = aligned[1].error;
  return out;
}

json metrics_of(const Truth& truth, const Measured& measured, Progress& progress) {
  const Estimate& estimate = measured.estimate;
  const PoseTrack track = track_at_true_times(truth, estimate, measured.name);

  json out;
  progress.begin("evaluate: path");
  const PoseErrors poses = pose_errors(truth.track(), track);
  out["trajectory"] = trajectory_json(poses);
  out["tracking"] = tracking_json(poses, estimate);
  out["alignment"] =
      transform_json(poses.sim3 ? std::optional(poses.sim3->truth_from_estimate) : std::nullopt);
  out["scale"] = scale_json(estimate, poses);
  out["frames"] = frames_json(truth, estimate, poses);
  progress.end();

  out["time"] = time_json(estimate);
  out["reconstruction"] = estimate.numbers;
  if (!truth.has_label("depth")) {  // the path alone
    const std::string note = "the dataset was made without depth";
    out["depth"] = {{"sim3", nullptr}, {"median_scaled", nullptr}, {"note", note}};
    out["coverage"] = nullptr;
    out["surface"] = surface_not_measured(note);
    return out;
  }

  progress.begin("evaluate: depth", truth.size());
  out["depth"] = depth_errors(truth, measured, poses, progress);
  progress.end();

  progress.begin("evaluate: wall seen", truth.size());
  std::vector<int> frames(static_cast<std::size_t>(truth.size()));
  std::iota(frames.begin(), frames.end(), 0);
  const Visibility visibility = wall_seen(truth, frames, progress);
  out["coverage"] = coverage_json(visibility);
  progress.end();

  progress.begin("evaluate: surface");
  out["surface"] = surface_errors(estimate, visibility.seen_wall(), poses);
  progress.end();
  return out;
}

}  // namespace

json evaluate(const fs::path& dataset, const fs::path& estimate_folder, Progress& progress) {
  const Truth truth = Truth::open(dataset);
  Measured measured{read_estimate(estimate_folder), estimate_folder.string()};
  const EstimateLayout layout{estimate_folder};
  measured.depth = [&](int frame) {
    const bool keyframe = measured.estimate.states[frame] == FrameState::keyframe;
    return keyframe && fs::exists(layout.depth(frame)) ? read_exr(layout.depth(frame)) : cv::Mat();
  };
  return metrics_of(truth, measured, progress);
}

void EstimateFiles::check() const {
  const bool more = !map.empty() || !depth.empty() || mm_per_unit != 1.0 || depth_scale != 1.0;
  rugae::check(!is_ours() || !more,
               "{}: an estimate has its own map, depth and unit; others' go with a trajectory",
               trajectory.string());
  rugae::check(
      !trajectory.empty() || !depth.empty(),
      "neither a path nor depth to measure: expected an estimate's folder, a trajectory in "
      "TUM format, or depth");
  rugae::check(map.empty() || !trajectory.empty(),
               "{}: a map is placed by the trajectory, which is missing", map.string());
  rugae::check(mm_per_unit > 0.0 && std::isfinite(mm_per_unit),
               "mm-per-unit is {}, expected above 0", mm_per_unit);
  rugae::check(depth_scale > 0.0 && std::isfinite(depth_scale),
               "depth-scale is {}, expected above 0", depth_scale);
}

json evaluate(const fs::path& dataset, const EstimateFiles& files, Progress& progress) {
  files.check();
  if (files.is_ours()) return evaluate(dataset, files.trajectory, progress);
  const Truth truth = Truth::open(dataset);
  check(files.depth.empty() || truth.has_label("depth"),
        "{}: made without depth, there is nothing to measure {} against", dataset.string(),
        files.depth.string());
  std::vector<double> times_s;
  for (const TimedPose& pose : truth.track()) times_s.push_back(pose.time_s);
  Measured measured;
  measured.name = (files.trajectory.empty() ? files.depth : files.trajectory).string();
  Estimate& estimate = measured.estimate;
  if (files.trajectory.empty()) {
    estimate.times_s = times_s;
    estimate.states.assign(times_s.size(), FrameState::lost);
    estimate.world_from_camera.resize(times_s.size());
  } else {
    estimate = estimate_of_trajectory(files.trajectory, times_s, files.mm_per_unit);
  }
  if (!files.map.empty()) estimate.map = read_mesh(files.map, files.mm_per_unit);
  std::map<int, fs::path> depth;
  if (!files.depth.empty()) depth = foreign_depth_files(files.depth, truth.size());
  measured.depth_is_mm = !depth.empty();
  measured.depth = [&](int frame) {
    const auto file = depth.find(frame);
    return file == depth.end()
               ? cv::Mat()
               : read_foreign_depth_mm(file->second, files.depth_scale * files.mm_per_unit);
  };
  return metrics_of(truth, measured, progress);
}

}  // namespace rugae
