#pragma once
// A world in which every true motion is known in closed form: a plate before a wall, both with
// texture, and a camera that moves along them.

#include <optional>
#include <utility>

#include "tests/recon/synthetic_texture.h"
#include "tests/studies/small_set.h"

namespace rugae::test {

class TwoPlanes {
 public:
  static constexpr int kFrames = 6, kWidth = 160, kHeight = 120;
  static constexpr double kPlate_mm = 20.0, kWall_mm = 40.0;  // z; the plate ends at x = 0

  TwoPlanes() {
    for (int i = 0; i < kFrames; ++i)
      poses_.emplace_back(Quat(Eigen::AngleAxisd(0.01 * i, Vec3(0.3, 0.2, 1.0).normalized())),
                          Vec3(1.5 - 0.7 * i, 0.2 * i, 0.3 * i));
  }

  /// Distorted, so that preprocessing has something to do.
  static Camera camera() {
    Camera camera = SmallSet(kWidth, kHeight, 80.0).camera;
    camera.lens.k1 = -0.08;
    return camera;
  }

  struct Place {
    Vec3 world;
    bool on_plate;
  };
  static Place hit(const Rigid3& pose, const Vec3& ray) {
    const Vec3 d = pose.rotation * ray, c = pose.translation;
    const Vec3 near = c + d * ((kPlate_mm - c.z()) / d.z());
    if (near.x() <= 0.0) return {near, true};
    return {c + d * ((kWall_mm - c.z()) / d.z()), false};
  }

  enum class Seen { yes, hidden, outside };
  struct Landing {
    Vec2 pixel;
    Seen seen;
  };
  /// Where what frame i sees at the pixel is in frame j.
  Landing led(int i, int j, const Vec2& pixel) const {
    const Lens lens = camera().lens;
    const Place place = hit(poses_[i], *lens.unproject(pixel));
    const Vec3 there = poses_[j].inverse() * place.world;
    const Vec2 landing = *lens.project(there);
    if (!lens.contains(landing)) return {landing, Seen::outside};
    const bool behind = !place.on_plate && hit(poses_[j], there.normalized()).on_plate;
    return {landing, behind ? Seen::hidden : Seen::yes};
  }
  /// The plate's edge runs between the pixel and a corner of the square of twice `px` around it.
  bool near_edge(int i, const Vec2& pixel, double px) const {
    const Lens lens = camera().lens;
    const auto on = [&](double dx, double dy) {
      return hit(poses_[i], *lens.unproject(pixel + Vec2(dx, dy))).on_plate;
    };
    const bool here = on(0, 0);
    return on(-px, -px) != here || on(px, -px) != here || on(-px, px) != here || on(px, px) != here;
  }

  /// Frames that show the textures, or nothing.
  SmallSet set(bool blank = false) const {
    SmallSet set(kWidth, kHeight, 80.0);
    set.camera = camera();
    const testing::Texture near(1, 5.0, 40.0), far(2, 5.0, 40.0);
    for (int i = 0; i < kFrames; ++i) {
      set.track.push_back({i / set.camera.sensor.fps, poses_[i]});
      const cv::Mat picture = testing::draw(kWidth, kHeight, [&](const Vec2& pixel) {
        const Place p = hit(poses_[i], *set.camera.lens.unproject(pixel));
        const Vec2 at = p.world.head<2>() / (p.on_plate ? 0.25 : 0.5);  // mm a pixel
        return (p.on_plate ? near : far)(at);
      });
      set.grays.push_back(blank ? cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(90))
                                : testing::to_8bit(picture));
    }
    const auto quad = [&set](double x0, double x1, double z) {
      constexpr double kFar_mm = 400.0;
      const int v = static_cast<int>(set.wall.vertices.size());
      for (const auto& [x, y] :
           {std::pair{x0, -kFar_mm}, {x1, -kFar_mm}, {x1, kFar_mm}, {x0, kFar_mm}})
        set.wall.vertices.emplace_back(x, y, z);
      set.wall.triangles.emplace_back(v, v + 1, v + 2);
      set.wall.triangles.emplace_back(v, v + 2, v + 3);
    };
    quad(-400.0, 0.0, kPlate_mm);
    quad(-400.0, 400.0, kWall_mm);
    return set;
  }

 private:
  std::vector<Rigid3> poses_;
};

}  // namespace rugae::test
