#pragma once
// The camera's pose while one frame is read out, row by row.

#include <cmath>
#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "core/rigid3.h"

namespace rugae {

/// With a rolling shutter the middle of the exposure of the image line at v px (the centre of row y
/// lies at v = y + 0.5) is (v - height / 2) row_time_s after the frame's time. Poses are known at
/// the centres of rows -1 to `height`; between them translation and quaternion are linear in v,
/// beyond them both pose and time hold.
class RowPoses {
 public:
  /// A global shutter: every row sees this pose.
  explicit RowPoses(const Rigid3& world_from_camera = {}) : poses_{world_from_camera} {}
  /// `world_from_camera` holds the poses of rows -1 to height, height + 2 of them; throws Error for
  /// fewer than three or a row time that is not above 0.
  RowPoses(std::vector<Rigid3> world_from_camera, double row_time_s);

  bool rolling() const { return poses_.size() > 1; }
  double row_time_s() const { return row_time_s_; }
  const std::vector<Rigid3>& poses() const { return poses_; }
  /// Pose of a row, 0 to height - 1.
  const Rigid3& of_row(int row) const {
    return poses_[rolling() ? static_cast<std::size_t>(row + 1) : 0];
  }
  Rigid3 at(double v) const;
  /// Time of a line after the frame's, s; 0 for a global shutter.
  double offset_s(double v) const;

  /// Where a point lands that is at world_point(offset_s) at that time: the line v at which the
  /// image of the point at the time of v lies on v, by the secant method to 1e-9 px from
  /// `near_v`. Empty when the lens does not see it.
  template <typename WorldPoint>
  std::optional<Vec2> landing(const LensProjector& lens, const WorldPoint& world_point,
                              double near_v) const;

 private:
  double height() const { return static_cast<double>(poses_.size()) - 2.0; }
  double held(double v) const { return std::min(std::max(v, -0.5), height() + 0.5); }

  std::vector<Rigid3> poses_;
  double row_time_s_ = 0.0;
};

template <typename WorldPoint>
std::optional<Vec2> RowPoses::landing(const LensProjector& lens, const WorldPoint& world_point,
                                      double near_v) const {
  const auto seen_at = [&](double v) {
    const Rigid3 pose = at(v);
    return lens.project(pose.rotation.toRotationMatrix().transpose() *
                        (world_point(offset_s(v)) - pose.translation));
  };
  if (!rolling()) return seen_at(near_v);
  constexpr double kSettled_px = 1e-9;
  constexpr int kSteps = 40;
  // Towards the borders a point may be in the lens's view at the time of its own line alone.
  for (const double start : {near_v, 0.5 * height(), 0.0, height()}) {
    double v = start, last_v = 0.0, last_error = 0.0;
    for (int step = 0; step < kSteps; ++step) {
      const auto seen = seen_at(v);
      if (!seen) break;
      const double error = seen->y() - v;
      if (std::abs(error) <= kSettled_px) return seen;
      double next = v + error;
      if (step > 0 && error != last_error) {
        const double secant = v - error * (v - last_v) / (error - last_error);
        // Far from linear: the plain iteration, which contracts while rows are read faster than
        // the image moves.
        if (std::abs(secant - next) <= 0.5 * std::abs(error)) next = secant;
      }
      last_v = v;
      last_error = error;
      v = next;
    }
  }
  return std::nullopt;
}

}  // namespace rugae
