#pragma once
// What only a simulator knows. Reconstruction must not include this file: scripts/check_layers.py
// sees to it.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "cameras/camera.h"
#include "core/mesh.h"
#include "core/pose_track.h"
#include "dataset/layout.h"

namespace rugae {

/// The labels of one frame; each matrix has the frame's size.
struct FrameTruth {
  cv::Mat depth_mm;  // CV_32F, NaN where nothing was hit
  cv::Mat normal;    // CV_32FC3, unit, camera axes, facing the camera; NaN where nothing was hit
  cv::Mat flow_px;   // CV_32FC2, to the next frame; NaN where invalid; empty for the last frame
  cv::Mat masks;     // CV_8U, bits FrameMask
  // On request, else empty:
  cv::Mat backward_flow_px;  // CV_32FC2, to the frame before; empty for the first
  cv::Mat triangle;  // CV_32FC3: index of the wall's triangle and the barycentric coordinates of
                     // its second and third corner; NaN where nothing was hit
};

class Truth {
 public:
  static Truth open(const std::filesystem::path& dataset);

  int size() const { return static_cast<int>(track_.size()); }
  const Camera& camera() const { return camera_; }
  const PoseTrack& track() const { return track_; }
  const TriangleMesh& wall() const { return wall_; }
  cv::Mat depth_mm(int index) const;
  cv::Mat normal(int index) const;
  cv::Mat flow_px(int index) const;
  cv::Mat masks(int index) const;

 private:
  DatasetLayout layout_;
  Camera camera_;
  PoseTrack track_;
  TriangleMesh wall_;
};

}  // namespace rugae
