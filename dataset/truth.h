#pragma once
// What only a simulator knows. Reconstruction must not include this file: scripts/check_layers.py
// sees to it.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "cameras/camera.h"
#include "cameras/row_poses.h"
#include "core/mesh.h"
#include "core/pose_track.h"
#include "dataset/label_images.h"
#include "dataset/layout.h"
#include "dataset/tracks.h"

namespace rugae {

/// The labels of one frame; each matrix has the frame's size. dataset/label_images.h lists them.
struct FrameTruth {
  cv::Mat depth_mm;  // CV_32F, NaN where nothing was hit
  cv::Mat normal;    // CV_32FC3, unit, camera axes, facing the camera; NaN where nothing was hit
  cv::Mat flow_px;   // CV_32FC2, to the next frame; NaN where invalid; empty for the last frame
  cv::Mat masks;     // CV_8U, bits FrameMask
  // On request, else empty:
  cv::Mat backward_flow_px;  // CV_32FC2, to the frame before; empty for the first
  cv::Mat range_mm;          // CV_32F, along the ray; NaN where nothing was hit
  cv::Mat triangle;  // CV_32FC3: index of the wall's triangle and the barycentric coordinates of
                     // its second and third corner; NaN where nothing was hit
  cv::Mat shading_normal;  // CV_32FC3, as `normal`, but interpolated between the vertices: it may
                           // bend past the horizon
  cv::Mat albedo;          // CV_32FC3, linear RGB of the wall under its wet layer
  cv::Mat diffuse, indirect;  // CV_32FC3, linear RGB: light that comes straight from the lights by
                              // the wall, and over other walls; in the units of the frame's
                              // radiance, vignetting included
  cv::Mat specular;           // CV_32F: by the wet layer; diffuse + specular + indirect = radiance
  cv::Mat region, instance;   // CV_8U: numbers of truth/regions.csv and truth/instances.csv
  std::vector<TrackSample> tracks;
  // Where there is something to say, else empty:
  PoseTrack row_poses;  // rolling shutter: of rows -1 to height, each at the middle of its exposure
  std::vector<Vec3f>
      wall_displacement_mm;  // of the wall's vertices from wall.ply, at the frame's time
};

/// truth/row_poses/*.txt; throws Error naming the file when it has not a pose for every row.
RowPoses read_row_poses(const std::filesystem::path& file, const Camera& camera);
/// The wall at a frame's time, from that at rest and truth/wall_motion/*.ply: without normals.
/// Throws Error naming the file when it has not one displacement a vertex.
TriangleMesh moved_wall(const TriangleMesh& rest, const std::filesystem::path& file);

class Truth {
 public:
  static Truth open(const std::filesystem::path& dataset);

  int size() const { return static_cast<int>(track_.size()); }
  const Camera& camera() const { return camera_; }
  const PoseTrack& track() const { return track_; }
  const TriangleMesh& wall() const { return wall_; }  // at rest
  bool wall_moves() const;
  /// Whether the dataset was made with a label (dataset/label_images.h).
  bool has_label(const std::string& name) const { return labels_.*label_image(name).wanted; }
  /// The wall at the frame's time: without normals where it has moved.
  TriangleMesh wall(int index) const;
  /// The camera while the frame was read out.
  RowPoses row_poses(int index) const;
  /// A label by its name (dataset/label_images.h). Throws Error naming the file when it is not
  /// there or not of the frame's size.
  cv::Mat label(const std::string& name, int index) const;
  cv::Mat depth_mm(int index) const { return label("depth", index); }
  cv::Mat normal(int index) const { return label("normals", index); }
  cv::Mat flow_px(int index) const { return label("flow", index); }
  cv::Mat masks(int index) const { return label("masks", index); }
  cv::Mat backward_flow_px(int index) const { return label("backward_flow", index); }
  cv::Mat triangle(int index) const { return label("triangles", index); }
  std::vector<TrackSample> tracks(int index) const { return read_tracks(layout_.tracks(index)); }

 private:
  DatasetLayout layout_;
  LabelSet labels_;
  Camera camera_;
  PoseTrack track_;
  TriangleMesh wall_;
};

}  // namespace rugae
