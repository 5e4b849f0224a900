#pragma once
// A cavity that breathes around a camera that turns and moves, both smooth functions of time, and
// the truth of it computed without the renderer.

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "render/frame.h"
#include "tests/render/walls.h"

namespace rugae::test {

/// Brown-Conrady written out once more, independent of the camera's own code.
inline Vec2 project_again(const Lens& lens, const Vec3& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const double radial = 1.0 + lens.k1 * r2 + lens.k2 * r2 * r2 + lens.k3 * r2 * r2 * r2;
  return {lens.fx * (x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x)) + lens.cx,
          lens.fy * (y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y) + lens.cy};
}

struct MovingWorld {
  static constexpr double kFps = 30.0;
  int frames = 12;
  double pace = 1.0;  // of camera and wall
  Camera camera;
  TriangleMesh rest;

  MovingWorld(int width, int height, int levels, double share_of_frame_read,
              double world_pace = 1.0)
      : pace(world_pace), camera(small_camera(width, height)), rest(folded_mesh(levels)) {
    if (share_of_frame_read > 0.0) {
      camera.sensor.shutter = Shutter::rolling;
      camera.sensor.row_time_us = 1e6 * share_of_frame_read / (kFps * height);
    }
  }

  double row_time_s() const { return 1e-6 * camera.sensor.row_time_us; }
  double offset_s(double v) const { return (v - 0.5 * camera.lens.height) * row_time_s(); }

  Rigid3 pose(double frame) const {
    const double t = pace * std::clamp(frame, 0.0, frames - 1.0);
    const Quat turn(Eigen::AngleAxisd(0.9 + 0.03 * t, Vec3(0.0, 0.6, 0.8)));
    const Quat nod(Eigen::AngleAxisd(0.1 * std::sin(0.4 * t), Vec3::UnitX()));
    return {turn * nod, Vec3(3.0 - 0.6 * t, 2.0 + 0.5 * std::sin(0.7 * t), -4.0 + 0.3 * t)};
  }
  void move_wall(double time_s, std::vector<Vec3>& vertices) const {
    const double t = pace * kFps * time_s;
    vertices.resize(rest.vertices.size());
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const Vec3& p = rest.vertices[v];
      vertices[v] = p * (1.0 + 0.02 * std::sin(0.5 * t + 0.1 * p.x())) +
                    Vec3(0.2 * std::sin(0.6 * t + 0.2 * p.z()), 0.0, 0.05 * t);
    }
  }
  /// Straight lines between the frames' times.
  std::vector<Vec3> wall_at(double frame) const {
    const double held = std::clamp(frame, 0.0, frames - 1.0);
    const int k = std::min(static_cast<int>(held), frames - 2);
    std::vector<Vec3> a, b;
    move_wall(k / kFps, a);
    move_wall((k + 1) / kFps, b);
    for (std::size_t v = 0; v < a.size(); ++v) a[v] += (held - k) * (b[v] - a[v]);
    return a;
  }

  FrameRenderer renderer(const LabelSet& labels) const {
    return {Surface(rest, constant_material(lambert(0.5f))), camera, {.labels = labels}};
  }
  SceneMotion motion(const FrameRenderer& renderer) const {
    return {
        renderer.wall(),
        [this](double time_s, std::vector<Vec3>& vertices) { move_wall(time_s, vertices); },
        [this](double frame) { return pose(frame); },
        {.frames = frames, .fps = kFps, .height = camera.lens.height, .row_time_s = row_time_s()}};
  }

  static Vec3 on_triangle(const std::vector<Vec3>& vertices, const Vec3i& t, const Vec3f& label) {
    const double b1 = label[1], b2 = label[2];
    return (1.0 - b1 - b2) * vertices[t[0]] + b1 * vertices[t[1]] + b2 * vertices[t[2]];
  }
  Vec3i triangle(const Vec3f& label) const {
    return rest.triangles[static_cast<std::size_t>(label[0])];
  }

  /// Where a labelled point lands in a frame, and when (in frames): plain iteration over the line
  /// it lands on.
  struct Landing {
    Vec2 pixel;
    double frame;
    Vec3 point, eye;
  };
  std::optional<Landing> follow(const Vec3f& label, int frame) const {
    // Vertices move on straight lines on either side of the frame's time.
    const auto before = wall_at(frame - 1), now = wall_at(frame), after = wall_at(frame + 1);
    const Vec3 p0 = on_triangle(before, triangle(label), label),
               p1 = on_triangle(now, triangle(label), label),
               p2 = on_triangle(after, triangle(label), label);
    double v = 0.5 * camera.lens.height;
    Landing landing{};
    for (int i = 0; i < 200; ++i) {
      // Rows that do not exist are not exposed: the times beyond them do not matter.
      const double in = std::clamp(v, 0.0, static_cast<double>(camera.lens.height));
      const double beat = offset_s(in) * kFps;
      landing.frame = frame + beat;
      const Rigid3 camera_pose = pose(landing.frame);
      landing.eye = camera_pose.translation;
      landing.point = beat < 0.0 ? Vec3(p1 - beat * (p0 - p1)) : Vec3(p1 + beat * (p2 - p1));
      const Vec3 in_camera = camera_pose.inverse() * landing.point;
      if (!(in_camera.z() > 0.2 * in_camera.norm())) return std::nullopt;
      landing.pixel = project_again(camera.lens, in_camera);
      v = landing.pixel.y();
    }
    return landing;
  }
};

}  // namespace rugae::test
