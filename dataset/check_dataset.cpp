#include "dataset/check_dataset.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/check.h"
#include "core/files.h"
#include "dataset/check_labels.h"
#include "dataset/check_surface_labels.h"
#include "dataset/diagnose.h"
#include "dataset/frame_list.h"
#include "dataset/image_io.h"
#include "dataset/manifest.h"
#include "dataset/ply_io.h"
#include "dataset/problem_list.h"
#include "dataset/row_pose_check.h"
#include "dataset/writer.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// One ray a pixel, through its centre.
bool is_sharp(const DatasetInfo& info) {
  const auto options = nlohmann::json::parse(info.text, nullptr, false);
  const auto lens = options.is_object() ? options.find("lens") : options.end();
  return lens == options.end() || !lens->is_object() || lens->value("samples", 1) == 1;
}

class Checker {
 public:
  explicit Checker(const fs::path& root) : layout_{root} {}

  DatasetCheck run() {
    const DatasetInfo info = read_info(layout_.info());
    result_.frames = info.frames;
    check_files();
    const auto camera = problems_.attempt([&] { return load_camera(layout_.camera().string()); });
    problems_.attempt([&] { return load_lens(layout_.calibration()); });
    const auto wall = problems_.attempt([&] {
      TriangleMesh mesh = read_ply(layout_.wall());
      check_mesh(mesh, layout_.wall().string());
      return mesh;
    });
    const auto track = problems_.attempt([&] { return read_tum(layout_.trajectory()); });
    if (track) check_track(*track, info.frames);
    if (track) check_times(*track, info.frames);
    if (camera) check_frames(camera->lens, info.frames);
    const bool labelled = camera && track && wall && static_cast<int>(track->size()) == info.frames;
    if (labelled && info.truth.row_poses) check_row_poses(layout_, *camera, *track, problems_);
    if (labelled)
      check_all_labels({layout_, camera->lens, *track, &*camera, &*wall, is_sharp(info)}, info);
    // Colour is led from frame to frame by one pose a frame and a wall that keeps still.
    if (labelled && info.truth.labels.depth && problems_.none() && !info.truth.row_poses &&
        !info.truth.wall_motion)
      check_colour(camera->lens, *track);
    if (problems_.none() && result_.flow_samples == 0)
      result_.notes.push_back(
          layout_.truth().string() +
          (info.truth.labels.flow
               ? ": nothing could be compared: no pixel's flow to the next frame is known"
               : ": nothing could be compared: made without flow"));
    result_.problems = problems_.take();
    return std::move(result_);
  }

 private:
  void note(std::string problem) { problems_.note(std::move(problem)); }
  void note_missing(const fs::path& file) {
    if (!fs::exists(file)) note(file.string() + ": missing");
  }

  void check_files() {
    result_.files = files_below(layout_.root, layout_.manifest().filename().string()).size();
    if (fs::exists(layout_.manifest()))
      check_manifest(layout_.root, problems_);
    else
      note(layout_.manifest().string() + ": missing: the dataset was not finished");
  }

  void check_track(const PoseTrack& track, int frames) {
    const std::string name = layout_.trajectory().string();
    if (static_cast<int>(track.size()) != frames)
      note(fmt::format("{}: {} poses for {} frames", name, track.size(), frames));
    check_moves(track, name, problems_);
  }

  void check_times(const PoseTrack& track, int frames) {
    const std::string name = layout_.frame_list().string();
    const auto records = problems_.attempt([&] { return read_frame_list(layout_.frame_list()); });
    if (!records) return;
    if (static_cast<int>(records->size()) != frames)
      note(fmt::format("{}: {} lines for {} frames", name, records->size(), frames));
    for (std::size_t i = 0; i < std::min(records->size(), track.size()); ++i)
      if ((*records)[i].time_s != track[i].time_s) {
        note(fmt::format("{}: frame {} at {} s, {} has {} s", name, i, (*records)[i].time_s,
                         layout_.trajectory().string(), track[i].time_s));
        return;
      }
  }

  void check_frames(const Lens& lens, int frames) {
    std::vector<std::string> problems(static_cast<std::size_t>(frames));
    tbb::parallel_for(0, frames, [&](int i) {
      if (!fs::exists(layout_.frame(i))) return;
      try {
        const cv::Mat image = read_image_bgr(layout_.frame(i));
        check(image.cols == lens.width && image.rows == lens.height,
              "{}: {} x {} px, {} says {} x {}", layout_.frame(i).string(), image.cols, image.rows,
              layout_.camera().string(), lens.width, lens.height);
      } catch (const Error& error) {
        problems[static_cast<std::size_t>(i)] = error.what();
      }
    });
    for (int i = 0; i < frames; ++i) {
      note_missing(layout_.frame(i));
      if (const auto& problem = problems[static_cast<std::size_t>(i)]; !problem.empty())
        note(problem);
    }
  }

  void check_all_labels(const LabelSources& sources, const DatasetInfo& info) {
    const int frames = info.frames;
    std::vector<LabelCheck> checks(static_cast<std::size_t>(frames));
    const auto named = problems_.attempt([&] { return read_named_numbers(layout_); });
    tbb::parallel_for(0, frames, [&](int i) {
      LabelCheck& found = checks[static_cast<std::size_t>(i)];
      found = check_labels(sources, i);
      if (!named) return;
      const auto more = check_surface_labels(sources, *named, i);
      found.problems.insert(found.problems.end(), more.begin(), more.end());
    });
    std::vector<FlowAgreement> flows;
    std::vector<std::pair<LabelProblem, int>> kinds;  // the first of each kind, and how many follow
    for (int i = 0; i < frames; ++i) {
      for (const auto& file : files_of_frame(layout_, info, i)) note_missing(file);
      const LabelCheck& found = checks[static_cast<std::size_t>(i)];
      result_.worst_flow_px = std::max(result_.worst_flow_px, found.flow.worst_px);
      result_.flow_samples += found.flow.samples;
      flows.push_back(found.flow);
      for (const LabelProblem& problem : found.problems) {
        const auto same = std::ranges::find_if(
            kinds, [&problem](const auto& k) { return k.first.kind == problem.kind; });
        if (problem.kind == "unreadable" || same == kinds.end())
          kinds.emplace_back(problem, 0);
        else
          ++same->second;
      }
    }
    for (const auto& [problem, more] : kinds)
      note(more == 0 ? problem.text
                     : fmt::format("{} (and in {} further frame{})", problem.text, more,
                                   more == 1 ? "" : "s"));
    for (std::string& line : tell_disagreements(layout_, sources.track, flows))
      note(std::move(line));
  }

  // Labels agree with each other: do they belong to the pictures?
  void check_colour(const Lens& lens, const PoseTrack& track) {
    WarpSequence sequence;
    sequence.lens = lens;
    for (const TimedPose& pose : track)
      sequence.world_from_camera.push_back(pose.world_from_camera);
    sequence.read_gray = [this](int i) { return read_image_gray(layout_.frame(i)); };
    sequence.read_depth_mm = [this](int i) { return read_exr(layout_.depth(i)); };
    const WarpNames names{layout_.frames().string(), layout_.depth(0).parent_path().string(),
                          layout_.trajectory().string(), layout_.flow(0).parent_path().string()};
    for (std::string& problem : diagnose_colour(sequence, names)) note(std::move(problem));
  }

  DatasetLayout layout_;
  ProblemList problems_;
  DatasetCheck result_;
};

}  // namespace

DatasetCheck check_dataset(const fs::path& root) {
  check(fs::is_directory(root), "{}: no such folder", root.string());
  check(fs::exists(DatasetLayout{root}.info()), "{}: not a dataset (no dataset.json)",
        root.string());
  return Checker(root).run();
}

}  // namespace rugae
