#pragma once
// Writes a dataset so that a killed run goes on where it stopped, and the finished one is proven by
// its manifest.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "core/mesh.h"
#include "core/pose_track.h"
#include "dataset/frame_images.h"
#include "dataset/label_images.h"
#include "dataset/layout.h"
#include "dataset/truth.h"

namespace rugae {

/// Files of truth that not every dataset has; `truth` in dataset.json names them.
struct TruthFiles {
  LabelSet labels;
  bool row_poses = false;    // rolling shutter
  bool wall_motion = false;  // moving wall
  bool tracks = false;
  bool coverage = false;  // counted from the triangles
};

/// What made a dataset; two runs with the same info write the same bytes.
struct DatasetInfo {
  std::string scene, camera, trajectory, resolution;
  std::uint64_t seed = 1;
  int frames = 0;
  ImageFiles images;
  TruthFiles truth;
  std::string text;  // every option as a canonical JSON object: a folder begun with another text
                     // is not continued
};

/// The text of dataset.json; throws Error when `info.text` is not JSON.
std::string info_json(const DatasetInfo& info);
/// Throws Error naming the file when it is missing, is not JSON, or lacks a field.
DatasetInfo read_info(const std::filesystem::path& file);

/// The files of one frame, its images last.
std::vector<std::filesystem::path> files_of_frame(const DatasetLayout& layout,
                                                  const DatasetInfo& info, int index);

class DatasetWriter {
 public:
  /// Creates the folders, or continues them when they were begun with the same info (what a killed
  /// run left half written is removed); throws Error otherwise ("...: holds another dataset (seed
  /// is 1, now 2); choose another folder or remove it"), and for a folder with other things in it.
  DatasetWriter(const std::filesystem::path& root, const DatasetInfo& info);

  /// Where the dataset was finished: throws Error naming the first file that has changed since, or
  /// that is none of it. The manifest would call it sound when it is written again. What is missing
  /// is no error, but a frame to be made.
  void check_finished() const;
  /// Throws Error when the track has not one pose a frame, or when an earlier run wrote another
  /// camera, path or wall.
  void write_scene(const Camera& camera, const PoseTrack& track, const TriangleMesh& wall);
  /// Points that frames follow.
  void write_track_points(const std::vector<TrackPoint>& points) const;
  /// True when all files of the frame are in place from an earlier run (files appear whole, so
  /// presence suffices).
  bool has_frame(int index) const;
  /// Safe to call from several threads for different frames. `bgr8` is the observation. The frame
  /// image itself is published last. Labels that the dataset has not are not looked at.
  void write_frame(int index, const cv::Mat& bgr8, const FrameTruth& truth,
                   const ExtraImages& extra = {}) const;
  /// frames.csv, then the manifest over every file. Only now is the dataset complete. Throws Error
  /// naming the first frame that was not written.
  void finish(const std::vector<double>& exposure_s, const std::vector<double>& gain) const;

  const DatasetLayout& layout() const { return layout_; }

 private:
  DatasetLayout layout_;
  DatasetInfo info_;
  PoseTrack track_;
  int width_ = 0, height_ = 0;  // px
};

}  // namespace rugae
