#pragma once
// A camera that moves while its rows are read one after another: where a point of the wall lands,
// and which ray a pixel would have had at the frame's time.

#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "core/rigid3.h"

namespace rugae {

/// How the world moves before a camera around a frame's time: a point p_cam is at
/// exp([turn] dt) p_cam + shift dt a time dt later.
struct CameraMotion {
  Vec3 turn_rad_per_s = Vec3::Zero();
  Vec3 shift_per_s = Vec3::Zero();  // map units

  /// cam(dt)_from_cam.
  Rigid3 after(double dt_s) const;
};

/// A pose, and how it changes while the rows are read.
struct MovingPose {
  Rigid3 cam_from_world;
  CameraMotion motion;
};

/// Of all poses (cam_from_world, empty where there is none): the slope of the parabola through each
/// and those nearest before and after, at an end the nearest two; of two poses the straight line.
std::vector<CameraMotion> motions_of(const std::vector<std::optional<Rigid3>>& cam_from_world,
                                     const std::vector<double>& times_s);

/// Where and when places of a straightened picture were seen. Calls are thread-safe.
class RollingShutter {
 public:
  /// `lens` of the picture; `original` of the sensor, whose rows are read `row_time_s` apart, the
  /// middle at the frame's time (cameras/row_poses.h). 0: a global shutter, all at once.
  RollingShutter(const Lens& lens, const Lens& original, double row_time_s);

  bool rolling() const { return row_time_s_ > 0.0; }
  const Lens& lens() const { return lens_; }
  const LensProjector& projector() const { return straight_projector_; }  // of lens()
  const Lens& original() const { return original_; }
  /// When the row of a point that the camera sees at p_cam was read, after the frame's time.
  double offset_s(const Vec3& p_cam) const;
  /// Pixel of a point that is at p_cam at the frame's time. Empty when the lens does not see it.
  std::optional<Vec2> project(const Vec3& p_cam, const CameraMotion& motion) const;
  /// The ray (x/z, y/z) at the frame's time of what was seen at `ray` and is at a z-depth of
  /// `depth` at that time. `ray` itself where that cannot be.
  Vec2 ray_at_frame_time(const Vec2& ray, double depth, const CameraMotion& motion) const;
  /// Where a point that is at p_cam at the frame's time is when its row is read. Empty where it is
  /// behind the camera then.
  std::optional<Vec3> when_seen(const Vec3& p_cam, const CameraMotion& motion) const;
  /// Pixel on the sensor of a point at p_cam.
  std::optional<Vec2> project_original(const Vec3& p_cam) const {
    return original_projector_.project(p_cam);
  }

 private:
  Lens lens_, original_;
  LensProjector straight_projector_, original_projector_;
  double row_time_s_;
};

}  // namespace rugae
