#pragma once
// A dataset and an estimate with known answers, made without renderer or reconstruction: a camera
// flying about inside a sphere.

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/sim3.h"
#include "dataset/estimate.h"
#include "dataset/image_io.h"
#include "dataset/writer.h"
#include "tests/validate/shapes.h"

namespace rugae::inside_sphere {

inline constexpr double kRadius_mm = 40.0;
inline constexpr int kFrames = 12, kWidth = 96, kHeight = 72;

inline Camera camera() {
  Camera camera;
  camera.name = "test";
  Lens& lens = camera.lens;
  lens.width = kWidth;
  lens.height = kHeight;
  lens.fx = lens.fy = 48.0;
  lens.cx = 48.0;
  lens.cy = 36.0;
  camera.sensor = {3.0, 30.0, 10, 1e4, 5.0, Shutter::global};
  camera.diameter_mm = 5.0;
  return camera;
}

inline PoseTrack track() {
  PoseTrack track;
  for (int i = 0; i < kFrames; ++i) {
    const double s = 0.25 * i;
    const Quat turn(Eigen::AngleAxisd(0.4 * s, Vec3(0.2, 1, 0.1).normalized()));
    track.push_back({i / 30.0, Rigid3(turn, Vec3(8 * std::cos(s), 6 * std::sin(s), 3 * s - 4))});
  }
  return track;
}

// |c + r d| = R has the one positive root r = -c.d + sqrt((c.d)^2 + R^2 - |c|^2) from inside.
inline FrameTruth labels(const Rigid3& now, const Rigid3* next) {
  const LensProjector lens(camera().lens);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  FrameTruth truth;
  truth.depth_mm = cv::Mat(kHeight, kWidth, CV_32F);
  truth.normal = cv::Mat(kHeight, kWidth, CV_32FC3);
  truth.masks = cv::Mat(kHeight, kWidth, CV_8U);
  if (next) truth.flow_px = cv::Mat(kHeight, kWidth, CV_32FC2);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Vec2 pixel(x + 0.5, y + 0.5);
      const Vec3 ray = *lens.unproject(pixel), d = now.rotation * ray, c = now.translation;
      const double b = c.dot(d);
      const double range = -b + std::sqrt(b * b + kRadius_mm * kRadius_mm - c.squaredNorm());
      const Vec3 hit = c + range * d, n = now.rotation.conjugate() * (-hit / kRadius_mm);
      truth.depth_mm.at<float>(y, x) = static_cast<float>(range * ray.z());
      truth.normal.at<cv::Vec3f>(y, x) = cv::Vec3f(
          static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()));
      unsigned char bits = kMaskValid;
      if (next) {
        const auto moved = lens.project(next->inverse() * hit);
        const bool inside = moved && camera().lens.contains(*moved);
        if (inside) bits |= kMaskFlowValid;
        truth.flow_px.at<cv::Vec2f>(y, x) =
            inside ? cv::Vec2f(static_cast<float>((*moved - pixel).x()),
                               static_cast<float>((*moved - pixel).y()))
                   : cv::Vec2f(nan, nan);
      }
      truth.masks.at<unsigned char>(y, x) = bits;
    }
  return truth;
}

struct Made {
  bool labelled = true;
  Vec3f moved_mm = Vec3f::Zero();  // wall and camera, from where the wall rests
};

inline void write_dataset(const std::filesystem::path& root, const Made& made = {}) {
  DatasetInfo info;
  if (!made.labelled) info.truth.labels = LabelSet::none();
  info.truth.wall_motion = !made.moved_mm.isZero();
  info.scene = "sphere";
  info.camera = "test";
  info.trajectory = "test";
  info.frames = kFrames;
  info.text = "{}";
  DatasetWriter writer(root, info);
  const PoseTrack poses = track();
  PoseTrack moved = poses;
  for (TimedPose& pose : moved) pose.world_from_camera.translation += made.moved_mm.cast<double>();
  const TriangleMesh wall = shapes::sphere(kRadius_mm, 40);
  writer.write_scene(camera(), moved, wall);
  for (int i = 0; i < kFrames; ++i) {
    const Rigid3* next = i + 1 < kFrames ? &poses[i + 1].world_from_camera : nullptr;
    FrameTruth truth = labels(poses[i].world_from_camera, next);
    truth.wall_displacement_mm.assign(wall.vertices.size(), made.moved_mm);
    cv::Mat bgr(kHeight, kWidth, CV_8UC3);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const double d = truth.depth_mm.at<float>(y, x);
        bgr.at<cv::Vec3b>(y, x) = cv::Vec3b(40, 60, cv::saturate_cast<unsigned char>(4e5 / d / d));
      }
    writer.write_frame(i, bgr, truth);
  }
  writer.finish(std::vector<double>(kFrames, 0.01), std::vector<double>(kFrames, 1.0));
}

/// The truth in a world of its own (turned, moved, `units_per_mm`), with the sphere as its map and
/// the true depth of every third frame; frame 5 is lost.
inline void write_estimate_of_truth(const std::filesystem::path& root, double units_per_mm,
                                    double radius_mm = kRadius_mm) {
  const Sim3 map_from_world{units_per_mm, Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 2) / 3)),
                            Vec3(1, -2, 3)};
  Estimate estimate;
  estimate.method = "paper";
  estimate.lens = camera().lens;
  estimate.options_json = "{}";
  estimate.stages = {{"adjustment", 1.0, 90.0}, {"adjustment", 0.5, 100.0}, {"map", 0.5, 200.0}};
  estimate.path_s = 1.5;
  estimate.numbers = {{"keyframes", 4.0}};
  const PoseTrack poses = track();
  for (int i = 0; i < kFrames; ++i) {
    estimate.times_s.push_back(poses[i].time_s);
    estimate.states.push_back(i == 5       ? FrameState::lost
                              : i % 3 == 0 ? FrameState::keyframe
                                           : FrameState::resected);
    estimate.world_from_camera.push_back(map_from_world * poses[i].world_from_camera);
  }
  estimate.map = shapes::sphere(radius_mm, 40);
  for (Vec3& v : estimate.map.vertices) v = map_from_world * v;
  std::filesystem::create_directories(EstimateLayout{root}.depth_folder());
  for (int i = 0; i < kFrames; i += 3)
    write_exr(EstimateLayout{root}.depth(i),
              labels(poses[i].world_from_camera, nullptr).depth_mm * units_per_mm);
  write_estimate(root, estimate);
}

}  // namespace rugae::inside_sphere
