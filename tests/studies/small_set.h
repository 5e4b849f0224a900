#pragma once
// Datasets whose frames and labels a test makes itself.

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "dataset/writer.h"

namespace rugae::test {

struct SmallSet {
  Camera camera;
  TriangleMesh wall;              // empty: a plane before the camera
  PoseTrack track;                // empty: standing still
  std::vector<cv::Mat> grays;     // CV_8U
  std::vector<FrameTruth> truth;  // empty: none
  LabelSet labels = LabelSet::none();
  std::string options = "{}";  // as in dataset.json

  SmallSet(int width, int height, double focal_px) {
    camera.name = "small";
    camera.diameter_mm = 3.0;
    camera.vignetting.cos4 = false;
    Lens& lens = camera.lens;
    lens.width = width;
    lens.height = height;
    lens.fx = lens.fy = focal_px;
    lens.cx = 0.5 * width;
    lens.cy = 0.5 * height;
    camera.sensor = {.pixel_pitch_um = 3.0,
                     .fps = 30.0,
                     .bit_depth = 10,
                     .full_well_e = 1e4,
                     .read_noise_e = 5.0,
                     .shutter = Shutter::global};
  }

  void write(const std::filesystem::path& root) const {
    DatasetInfo info;
    info.scene = info.camera = info.trajectory = "small";
    info.frames = static_cast<int>(grays.size());
    info.truth.labels = labels;
    info.text = options;
    DatasetWriter writer(root, info);
    PoseTrack poses = track;
    if (poses.empty())
      for (std::size_t i = 0; i < grays.size(); ++i)
        poses.push_back({static_cast<double>(i) / camera.sensor.fps, Rigid3()});
    TriangleMesh mesh = wall;
    if (mesh.empty()) {
      mesh.vertices = {{-99, -99, 20}, {99, -99, 20}, {99, 99, 20}, {-99, 99, 20}};
      mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
    }
    writer.write_scene(camera, poses, mesh);
    for (int i = 0; i < info.frames; ++i) {
      const auto at = static_cast<std::size_t>(i);
      cv::Mat bgr;
      cv::cvtColor(grays[at], bgr, cv::COLOR_GRAY2BGR);
      writer.write_frame(i, bgr, truth.empty() ? FrameTruth{} : truth[at]);
    }
    writer.finish(std::vector<double>(grays.size(), 0.01), std::vector<double>(grays.size(), 1.0));
  }
};

}  // namespace rugae::test
