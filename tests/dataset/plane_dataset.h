#pragma once
// A tiny dataset whose every label is known in closed form: a camera moves in front of a plane.

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "core/check.h"
#include "dataset/writer.h"

namespace rugae::testing {

/// A fresh folder below the system's temporary folder, removed at the end of the scope.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& name) {
    path_ = std::filesystem::temp_directory_path() /
            fmt::format("rugae_test_{}_{}", name, static_cast<long>(::getpid()));
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The plane n . p = offset in the world, and the camera's path before it.
struct PlaneWorld {
  Vec3 normal = Vec3(0.1, -0.2, -1.0).normalized();  // towards the camera
  double offset_mm = -30.0;
  Camera camera;
  PoseTrack track;

  explicit PlaneWorld(int frames = 5) {
    camera.name = "tiny";
    camera.diameter_mm = 3.0;
    Lens& lens = camera.lens;
    lens.width = 64;
    lens.height = 48;
    lens.fx = 40.0;
    lens.fy = 41.0;
    lens.cx = 31.0;
    lens.cy = 25.0;
    lens.k1 = -0.1;
    lens.k2 = 0.01;
    lens.p1 = 1e-3;
    lens.p2 = -2e-3;
    camera.sensor = {.pixel_pitch_um = 3.0,
                     .fps = 10.0,
                     .bit_depth = 10,
                     .full_well_e = 10000.0,
                     .read_noise_e = 5.0,
                     .shutter = Shutter::global};
    for (int i = 0; i < frames; ++i) {
      const double turn_rad = 0.02 * i;
      const Quat rotation(Eigen::AngleAxisd(turn_rad, Vec3(0.3, 1.0, 0.5).normalized()));
      // The step towards the plane differs from frame to frame, so that no two depths are alike.
      track.push_back(
          {i / camera.sensor.fps,
           Rigid3(rotation, Vec3(0.8 * i, -0.5 * i, 0.9 * i + 0.3 * std::sin(1.7 * i)))});
    }
  }

  /// Where a camera's ray meets the plane, in camera coordinates:
  /// n . (R d s + t) = offset  =>  s = (offset - n . t) / (n . R d).
  Vec3 point_cam(const Rigid3& world_from_camera, const Vec3& ray_cam) const {
    const double towards = normal.dot(world_from_camera.rotation * ray_cam);
    return ray_cam * ((offset_mm - normal.dot(world_from_camera.translation)) / towards);
  }

  cv::Mat image(int index) const {
    cv::Mat bgr(camera.lens.height, camera.lens.width, CV_8UC3);
    const Rigid3& pose = track[static_cast<std::size_t>(index)].world_from_camera;
    for (int y = 0; y < bgr.rows; ++y)
      for (int x = 0; x < bgr.cols; ++x) {
        const Vec3 p = pose * point_cam(pose, *camera.lens.unproject(Vec2(x + 0.5, y + 0.5)));
        bgr.at<cv::Vec3b>(y, x) =
            cv::Vec3b(static_cast<unsigned char>(127.5 + 100.0 * std::sin(1.1 * p.x())),
                      static_cast<unsigned char>(127.5 + 100.0 * std::sin(0.9 * p.y())),
                      static_cast<unsigned char>(127.5 + 100.0 * std::sin(p.x() + p.y())));
      }
    return bgr;
  }

  FrameTruth truth(int index) const {
    const Lens& lens = camera.lens;
    const auto at = static_cast<std::size_t>(index);
    const Rigid3& pose = track[at].world_from_camera;
    const bool last = at + 1 == track.size();
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    FrameTruth truth;
    truth.depth_mm.create(lens.height, lens.width, CV_32FC1);
    truth.normal.create(lens.height, lens.width, CV_32FC3);
    truth.masks.create(lens.height, lens.width, CV_8UC1);
    if (!last) truth.flow_px.create(lens.height, lens.width, CV_32FC2);
    const Vec3 normal_cam = pose.rotation.conjugate() * normal;
    for (int y = 0; y < lens.height; ++y)
      for (int x = 0; x < lens.width; ++x) {
        const Vec2 pixel(x + 0.5, y + 0.5);
        const Vec3 p = point_cam(pose, *lens.unproject(pixel));
        truth.depth_mm.at<float>(y, x) = static_cast<float>(p.z());
        truth.normal.at<cv::Vec3f>(y, x) =
            cv::Vec3f(static_cast<float>(normal_cam.x()), static_cast<float>(normal_cam.y()),
                      static_cast<float>(normal_cam.z()));
        auto& mask = truth.masks.at<unsigned char>(y, x);
        mask = kMaskValid;
        if (last) continue;
        const auto seen = lens.project(track[at + 1].world_from_camera.inverse() * (pose * p));
        auto& flow = truth.flow_px.at<cv::Vec2f>(y, x);
        flow = {kNone, kNone};
        if (!seen || !lens.contains(*seen)) continue;
        mask |= kMaskFlowValid;
        flow = cv::Vec2f(static_cast<float>(seen->x() - pixel.x()),
                         static_cast<float>(seen->y() - pixel.y()));
      }
    return truth;
  }

  /// Two triangles of the plane, large enough to fill every frame.
  TriangleMesh wall() const {
    const Vec3 u = normal.unitOrthogonal() * 500.0, v = normal.cross(u), c = normal * offset_mm;
    TriangleMesh mesh;
    mesh.vertices = {c - u - v, c + u - v, c + u + v, c - u + v};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
  }

  DatasetInfo info() const {
    DatasetInfo info;
    info.scene = "plane";
    info.camera = camera.name;
    info.trajectory = "line";
    info.resolution = "coarse";
    info.frames = static_cast<int>(track.size());
    info.text = R"({"noise": false})";
    return info;
  }

  void write(const std::filesystem::path& root) const {
    DatasetWriter writer(root, info());
    writer.write_scene(camera, track, wall());
    for (int i = 0; i < info().frames; ++i)
      if (!writer.has_frame(i)) writer.write_frame(i, image(i), truth(i));
    writer.finish(std::vector<double>(track.size(), 0.01), std::vector<double>(track.size(), 1.0));
  }
};

/// The text of the Error that `action` throws; "no error" when it does not.
template <typename Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace rugae::testing
