#pragma once
// Writes a dataset so that a killed run goes on where it stopped, and the finished one is proven by
// its manifest.

#include <filesystem>
#include <string>

#include "cameras/camera.h"
#include "core/mesh.h"
#include "core/pose_track.h"
#include "dataset/layout.h"
#include "dataset/truth.h"

namespace rugae {

/// What made a dataset; two runs with the same info write the same bytes.
struct DatasetInfo {
  std::string scene, camera, trajectory, resolution;
  std::uint64_t seed = 1;
  int frames = 0;
  std::string
      text;  // every option as canonical JSON: a folder begun with another text is not continued
};

class DatasetWriter {
 public:
  /// Creates the folders, or continues them when they were begun with the same info; throws Error
  /// otherwise
  /// ("...: holds another dataset (seed 1, now 2); choose another folder or remove it").
  DatasetWriter(const std::filesystem::path& root, const DatasetInfo& info);

  void write_scene(const Camera& camera, const PoseTrack& track, const TriangleMesh& wall);
  /// True when all files of the frame are in place from an earlier run (files appear whole, so
  /// presence suffices).
  bool has_frame(int index) const;
  /// Safe to call from several threads for different frames. `bgr8` is the observation. The frame
  /// image itself is published last.
  void write_frame(int index, const cv::Mat& bgr8, const FrameTruth& truth) const;
  /// frames.csv, then the manifest over every file. Only now is the dataset complete.
  void finish(const std::vector<double>& exposure_s, const std::vector<double>& gain) const;

  const DatasetLayout& layout() const { return layout_; }

 private:
  DatasetLayout layout_;
  DatasetInfo info_;
  PoseTrack track_;
};

}  // namespace rugae
