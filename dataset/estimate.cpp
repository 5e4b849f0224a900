#include "dataset/estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "dataset/csv.h"
#include "dataset/layout.h"
#include "dataset/ply_io.h"

namespace rugae {
namespace fs = std::filesystem;
using nlohmann::json;
namespace {

constexpr const char* kListHeader = "index,time_s,state";
constexpr std::array<const char*, 3> kStates = {"lost", "keyframe", "resected"};

std::string list_text(const Estimate& estimate) {
  std::string text = std::string(kListHeader) + "\n";
  for (std::size_t i = 0; i < estimate.times_s.size(); ++i)
    text += fmt::format("{},{:.17g},{}\n", i, estimate.times_s[i],
                        kStates[static_cast<std::size_t>(estimate.states[i])]);
  return text;
}

void read_list(const fs::path& file, Estimate& estimate) {
  for (const CsvLine& line : read_csv(file, kListHeader)) {
    const auto state = std::ranges::find(kStates, line.cells[2]);
    check(state != kStates.end(), "{}:{}: state '{}', expected one of: {}", file.string(),
          line.number, line.cells[2], fmt::join(kStates, ", "));
    estimate.times_s.push_back(csv_number(file, line, 1));
    estimate.states.push_back(static_cast<FrameState>(state - kStates.begin()));
  }
}

// Poses of the trajectory belong to the tracked frames in their order; the times must agree.
void read_poses(const EstimateLayout& layout, Estimate& estimate) {
  const PoseTrack track = read_tum(layout.trajectory());
  estimate.world_from_camera.resize(estimate.times_s.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < estimate.times_s.size(); ++i) {
    if (estimate.states[i] == FrameState::lost) continue;
    check(next < track.size() && track[next].time_s == estimate.times_s[i],
          "{}: no pose at {} s, though {} calls frame {} {}", layout.trajectory().string(),
          estimate.times_s[i], layout.frame_list().string(), i,
          kStates[static_cast<std::size_t>(estimate.states[i])]);
    estimate.world_from_camera[i] = track[next++].world_from_camera;
  }
  check(next == track.size(), "{}: {} poses, {} names {} tracked frames",
        layout.trajectory().string(), track.size(), layout.frame_list().string(), next);
}

int count(const Estimate& estimate, FrameState state) {
  return static_cast<int>(std::ranges::count(estimate.states, state));
}

std::string length_unit(const Estimate& estimate) {
  return estimate.scale_sigma_share ? "mm" : "map units";
}

json info_of(const Estimate& estimate) {
  json stages = json::array();
  for (const StageTime& stage : estimate.stages)
    stages.push_back(
        {{"name", stage.name}, {"seconds", stage.seconds}, {"peak_rss_mb", stage.peak_rss_mb}});
  json options = json::object();
  if (!estimate.options_json.empty()) {
    options = json::parse(estimate.options_json, nullptr, false);
    check(!options.is_discarded(), "the options of the estimate are not JSON: {}",
          estimate.options_json);
  }
  json units = {{"length", length_unit(estimate)}, {"time", "s"}};
  if (estimate.scale_sigma_share) units["length_sigma_share"] = *estimate.scale_sigma_share;
  return {{"method", estimate.method},
          {"frames", estimate.times_s.size()},
          {"keyframe", count(estimate, FrameState::keyframe)},
          {"resected", count(estimate, FrameState::resected)},
          {"lost", count(estimate, FrameState::lost)},
          {"numbers", estimate.numbers},
          {"stages", stages},
          {"path_s", estimate.path_s},
          {"options", options},
          {"units", units}};
}

// JSON has no NaN: nlohmann writes null for it.
double number(const json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

void read_numbers(const fs::path& file, Estimate& estimate) {
  const json object = json::parse(read_text(file), nullptr, false);
  check(object.is_object(), "{}: not a JSON object", file.string());
  try {
    object.at("method").get_to(estimate.method);
    for (const auto& [name, value] : object.at("numbers").items())
      estimate.numbers[name] = number(value);
    for (const json& stage : object.at("stages"))
      estimate.stages.push_back({stage.at("name").get<std::string>(), number(stage.at("seconds")),
                                 number(stage.at("peak_rss_mb"))});
    estimate.path_s = number(object.at("path_s"));
    estimate.options_json = object.at("options").dump();
    const json& units = object.at("units");
    if (units.at("length") == "mm")
      estimate.scale_sigma_share = number(units.at("length_sigma_share"));
  } catch (const json::exception& error) {
    fail("{}: not the description of an estimate: {}", file.string(), error.what());
  }
}

}  // namespace

fs::path EstimateLayout::depth(int index) const {
  return depth_folder() / fmt::format("{:06}.exr", index);
}

PoseTrack Estimate::track() const {
  PoseTrack track;
  for (std::size_t i = 0; i < times_s.size(); ++i)
    if (states[i] != FrameState::lost) track.push_back({times_s[i], world_from_camera[i]});
  return track;
}

void make_estimate_folder(const fs::path& root) {
  const DatasetLayout dataset{root};
  const fs::path frames = dataset.frames().filename();
  check(!fs::exists(dataset.info()) && !fs::is_directory(root / frames),
        "{}: holds {}, expected a folder of the estimate's own", root.string(),
        fs::exists(dataset.info()) ? "a dataset" : "frames of observations");
  make_folder(root);
}

void discard_estimate(const fs::path& root) {
  const EstimateLayout layout{root};
  const bool finished = fs::exists(layout.info());
  std::vector<fs::path> old{layout.info(), layout.map_glb(), layout.map_ply()};
  if (fs::is_directory(layout.depth_folder()))
    for (const auto& entry : fs::directory_iterator(layout.depth_folder()))
      if (entry.path().extension() == ".exr") old.push_back(entry.path());
  for (const fs::path& file : old) {
    std::error_code failed;
    fs::remove(file, failed);
    check(!failed, "{}: cannot be removed: {}", file.string(), failed.message());
  }
  // A folder of this name in any other folder is somebody else's.
  if (finished) fs::remove_all(layout.pictures());
}

void write_estimate(const fs::path& root, const Estimate& estimate) {
  check(estimate.states.size() == estimate.times_s.size() &&
            estimate.world_from_camera.size() == estimate.times_s.size(),
        "{}: {} times, {} states and {} poses: one of each is needed a frame", root.string(),
        estimate.times_s.size(), estimate.states.size(), estimate.world_from_camera.size());
  const EstimateLayout layout{root};
  const std::string info = info_of(estimate).dump(2) + "\n";
  make_folder(root);
  std::error_code none_before;
  fs::remove(layout.info(), none_before);  // an estimate being rewritten is not a finished one
  if (estimate.map.empty()) fs::remove(layout.map_glb(), none_before);
  write_atomic(layout.trajectory(), tum_text(estimate.track()));
  write_atomic(layout.frame_list(), list_text(estimate));
  write_atomic(layout.lens(), lens_yaml(estimate.lens, "the lens used by the reconstruction"));
  TriangleMesh points;
  points.vertices = estimate.points;
  const std::string unit = length_unit(estimate);
  write_ply(layout.points(), points, true, unit);
  write_ply(layout.map_ply(), estimate.map, false, unit);
  if (!estimate.map.empty()) write_glb(layout.map_glb(), estimate.map);
  write_atomic(layout.info(), info);
}

Estimate read_estimate(const fs::path& root) {
  const EstimateLayout layout{root};
  check(fs::is_directory(root), "{}: no such folder", root.string());
  check(fs::exists(layout.info()), "{}: the estimate was not finished (no estimate.json)",
        root.string());
  Estimate estimate;
  read_numbers(layout.info(), estimate);
  read_list(layout.frame_list(), estimate);
  read_poses(layout, estimate);
  estimate.lens = load_lens(layout.lens());
  estimate.map = read_ply(layout.map_ply());
  estimate.points = read_ply(layout.points()).vertices;
  return estimate;
}

}  // namespace rugae
