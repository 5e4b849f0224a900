#pragma once
// What a reconstruction leaves on disk; the only thing validation reads of it.
//
//   ESTIMATE/
//     estimate.json              method, options, counts and errors, stages with times; written
//     last trajectory.txt             TUM, world_from_camera of the tracked frames, in map units
//     frames.csv                 index,time_s,state: keyframe | resected | lost
//     lens.yaml                  the calibration used
//     map.ply  map.glb           the map, same world as trajectory.txt
//     points.ply                 the sparse points of the bundle adjustment
//     depth/000012.exr           z-depth in map units, on the pixel grid of the original
//     (distorted)
//                                frame; NaN: unknown
//     pictures/<stage>/<name>.png   intermediates for people
// Map units are what the reconstruction chose: their length in mm is unknown unless it says so
// (units.length of estimate.json is "mm" then, and units.length_sigma_share how well it knows).

#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "core/mesh.h"
#include "core/pose_track.h"
#include "core/progress.h"

namespace rugae {

enum class FrameState { lost, keyframe, resected };

struct Estimate {
  std::string method;
  std::vector<double> times_s;            // of all frames of the observations
  std::vector<FrameState> states;         // of all frames
  std::vector<Rigid3> world_from_camera;  // of all frames; meaningless where lost
  Lens lens;
  TriangleMesh map;
  std::vector<Vec3> points;  // sparse
  std::vector<StageTime> stages;
  double path_s = 0.0;  // of these, until every pose was known; the rest is the map's
  std::map<std::string, double>
      numbers;  // counts and errors a reader wants: keyframes, tracks, mean_reprojection_px, ...
  std::string options_json;
  /// Lengths are in mm, all of them off by one factor of this standard deviation; empty: map units.
  std::optional<double> scale_sigma_share;

  /// The tracked frames, in order of time.
  PoseTrack track() const;
};

struct EstimateLayout {
  std::filesystem::path root;
  std::filesystem::path info() const { return root / "estimate.json"; }
  std::filesystem::path trajectory() const { return root / "trajectory.txt"; }
  std::filesystem::path frame_list() const { return root / "frames.csv"; }
  std::filesystem::path lens() const { return root / "lens.yaml"; }
  std::filesystem::path map_ply() const { return root / "map.ply"; }
  std::filesystem::path map_glb() const { return root / "map.glb"; }
  std::filesystem::path points() const { return root / "points.ply"; }
  std::filesystem::path depth(int index) const;
  std::filesystem::path depth_folder() const { return root / "depth"; }
  std::filesystem::path pictures() const { return root / "pictures"; }
};

/// Everything but depth maps and pictures, which the pipeline writes as it goes. estimate.json is
/// written last.
void write_estimate(const std::filesystem::path& root, const Estimate& estimate);
/// Makes the folder of an estimate. Throws Error for one that holds a dataset or its observations,
/// whose files the estimate's would mix with and write over.
void make_estimate_folder(const std::filesystem::path& root);
/// Takes from a folder what an earlier estimate left there and the next one might not write over:
/// estimate.json first, so that what is left is no finished estimate, the depth of its key frames,
/// its pictures, its map.
void discard_estimate(const std::filesystem::path& root);
/// Map, points and trajectory included. Throws Error when estimate.json is missing ("... was not
/// finished").
Estimate read_estimate(const std::filesystem::path& root);

}  // namespace rugae
