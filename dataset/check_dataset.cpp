#include "dataset/check_dataset.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "core/check.h"
#include "core/files.h"
#include "dataset/check_labels.h"
#include "dataset/frame_list.h"
#include "dataset/image_io.h"
#include "dataset/manifest.h"
#include "dataset/ply_io.h"
#include "dataset/writer.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// A camera that never moves further than this from its first pose has lost its path: mm and rad.
constexpr double kMoves = 1e-6;

class Checker {
 public:
  explicit Checker(const fs::path& root) : layout_{root} {}

  DatasetCheck run() {
    const DatasetInfo info = read_info(layout_.info());
    result_.frames = info.frames;
    check_manifest();
    const auto camera = attempt([&] { return load_camera(layout_.camera().string()); });
    attempt([&] { return load_lens(layout_.calibration()); });
    attempt([&] {
      const TriangleMesh wall = read_ply(layout_.wall());
      check_mesh(wall, layout_.wall().string());
      return wall.vertices.size();
    });
    const auto track = attempt([&] { return read_tum(layout_.trajectory()); });
    if (track) check_track(*track, info.frames);
    if (track) check_times(*track, info.frames);
    if (camera) check_frames(camera->lens, info.frames);
    if (camera && track && info.labels && static_cast<int>(track->size()) == info.frames)
      check_all_labels({layout_, camera->lens, *track}, info.frames);
    return std::move(result_);
  }

 private:
  void note(std::string problem) {
    if (std::ranges::find(result_.problems, problem) == result_.problems.end())
      result_.problems.push_back(std::move(problem));
  }

  // The result of `action`, or nothing and its error noted. Files that are not there were noted
  // when the manifest was read.
  template <typename Action>
  auto attempt(Action&& action) -> std::optional<decltype(action())> {
    try {
      return action();
    } catch (const Error& error) {
      const std::string text = error.what();
      if (!text.ends_with(": no such file")) note(text);
      return std::nullopt;
    }
  }

  void note_missing(const fs::path& file) {
    if (!fs::exists(file)) note(file.string() + ": missing");
  }

  void check_manifest() {
    const auto files = files_below(layout_.root, layout_.manifest().filename().string());
    result_.files = files.size();
    if (!fs::exists(layout_.manifest())) {
      note(layout_.manifest().string() + ": missing: the dataset was not finished");
      return;
    }
    const auto expected = attempt([&] { return read_manifest(layout_.manifest()); });
    if (!expected) return;
    const std::set<std::string> present(files.begin(), files.end());
    for (const auto& [file, hash] : *expected)
      if (!present.contains(file)) note((layout_.root / file).string() + ": missing");
    const auto hashes = hashes_of(layout_.root, files);
    for (std::size_t i = 0; i < files.size(); ++i) {
      const auto entry = expected->find(files[i]);
      const std::string name = (layout_.root / files[i]).string();
      if (entry == expected->end())
        note(name + ": not in the manifest");
      else if (entry->second != hashes[i])
        note(
            fmt::format("{}: changed since it was written (SHA-256 {}..., the manifest says {}...)",
                        name, hashes[i].substr(0, 8), entry->second.substr(0, 8)));
    }
  }

  void check_track(const PoseTrack& track, int frames) {
    const std::string name = layout_.trajectory().string();
    if (static_cast<int>(track.size()) != frames)
      note(fmt::format("{}: {} poses for {} frames", name, track.size(), frames));
    if (track.size() < 2) return;
    const Rigid3& first = track.front().world_from_camera;
    const bool moves = std::ranges::any_of(track, [&first](const TimedPose& pose) {
      const Rigid3& p = pose.world_from_camera;
      return (p.translation - first.translation).norm() > kMoves ||
             angle_between_rad(p.rotation, first.rotation) > kMoves;
    });
    if (!moves) note(fmt::format("{}: the camera never moves: {} equal poses", name, track.size()));
  }

  void check_times(const PoseTrack& track, int frames) {
    const std::string name = layout_.frame_list().string();
    const auto records = attempt([&] { return read_frame_list(layout_.frame_list()); });
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

  void check_all_labels(const LabelSources& sources, int frames) {
    std::vector<LabelCheck> checks(static_cast<std::size_t>(frames));
    tbb::parallel_for(
        0, frames, [&](int i) { checks[static_cast<std::size_t>(i)] = check_labels(sources, i); });
    std::vector<std::pair<LabelProblem, int>> kinds;  // the first of each kind, and how many follow
    for (int i = 0; i < frames; ++i) {
      for (const auto& file : {layout_.depth(i), layout_.normals(i), layout_.masks(i)})
        note_missing(file);
      if (i + 1 < frames) note_missing(layout_.flow(i));
      const LabelCheck& found = checks[static_cast<std::size_t>(i)];
      result_.worst_flow_px = std::max(result_.worst_flow_px, found.worst_flow_px);
      result_.flow_samples += found.flow_samples;
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
  }

  DatasetLayout layout_;
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
