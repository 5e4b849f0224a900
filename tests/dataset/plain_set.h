#pragma once
// A sequence in memory that is written as a folder the way others lay theirs out, and the mistakes
// they make.

#include <algorithm>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "core/check.h"
#include "core/files.h"
#include "core/pose_track.h"
#include "dataset/image_io.h"
#include "dataset/layout.h"

namespace rugae::testing {

struct PlainSet {
  Lens lens;
  PoseTrack track;
  std::vector<cv::Mat> images, depths_mm, flows_px;

  /// The frames of a dataset.
  static PlainSet of(const std::filesystem::path& dataset) {
    const DatasetLayout layout{dataset};
    PlainSet set;
    set.lens = load_lens(layout.calibration());
    set.track = read_tum(layout.trajectory());
    for (int i = 0; i < static_cast<int>(set.track.size()); ++i) {
      set.images.push_back(read_image_bgr(layout.frame(i)));
      set.depths_mm.push_back(read_exr(layout.depth(i)));
      if (std::filesystem::exists(layout.flow(i))) set.flows_px.push_back(read_exr(layout.flow(i)));
    }
    return set;
  }

  /// images/ depth/ flow/ poses.txt calibration.yaml; a flow an image at most.
  void write(const std::filesystem::path& folder) const {
    namespace fs = std::filesystem;
    fs::remove_all(folder);
    for (const char* part : {"images", "depth"}) make_folder(folder / part);
    if (!flows_px.empty()) make_folder(folder / "flow");
    const auto name = [&](const char* part, std::size_t i, const char* extension) {
      return folder / part / fmt::format("{}{}", i, extension);
    };
    for (std::size_t i = 0; i < images.size(); ++i) {
      write_image(name("images", i, ".png"), images[i]);
      write_exr(name("depth", i, ".exr"), depths_mm[i]);
      if (i < flows_px.size()) write_exr(name("flow", i, ".exr"), flows_px[i]);
    }
    write_atomic(folder / "poses.txt", tum_text(track));
    write_atomic(folder / "calibration.yaml", lens_yaml(lens, "made by others"));
  }

  PlainSet without_flow() const {
    PlainSet set = *this;
    set.flows_px.clear();
    return set;
  }
  PlainSet with_poses(const std::function<Rigid3(const Rigid3&)>& change) const {
    PlainSet set = *this;
    for (TimedPose& pose : set.track) pose.world_from_camera = change(pose.world_from_camera);
    return set;
  }
  PlainSet with_depths(const std::function<cv::Mat(const cv::Mat&)>& change) const {
    PlainSet set = *this;
    for (cv::Mat& depth : set.depths_mm) depth = change(depth);
    return set;
  }
  PlainSet with_flows(const std::function<cv::Mat(const cv::Mat&)>& change) const {
    PlainSet set = *this;
    for (cv::Mat& flow : set.flows_px) flow = change(flow);
    return set;
  }
  /// `part` of frame i is that of frame i + `shift`; the frames at the ends, which have none, go.
  template <typename T>
  PlainSet shifted(std::vector<T> PlainSet::*part, int shift) const {
    PlainSet set = *this;
    const auto cut = [&](auto& values, int from) {
      if (values.empty()) return;
      values.erase(values.begin(), values.begin() + from);
    };
    const int others = shift < 0 ? -shift : 0, own = shift > 0 ? shift : 0;
    cut(set.images, others);
    cut(set.depths_mm, others);
    cut(set.flows_px, others);
    cut(set.track, others);
    set.*part = this->*part;
    cut(set.*part, own);
    const std::size_t frames =
        std::min({set.images.size(), set.depths_mm.size(), set.track.size()});
    set.images.resize(frames);
    set.depths_mm.resize(frames);
    set.track.resize(frames);
    if (set.flows_px.size() > frames) set.flows_px.resize(frames);
    for (std::size_t i = 0; i < frames; ++i) set.track[i].time_s = static_cast<double>(i);
    return set;
  }
};

}  // namespace rugae::testing
