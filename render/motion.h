#pragma once
// Camera and wall over a sequence: where both are while a frame is taken.

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "cameras/row_poses.h"
#include "render/tile.h"
#include "render/wall.h"

namespace rugae {

/// The camera's pose at a time counted in frames from the first; before the first and after the
/// last the camera stands still.
using CameraPath = std::function<Rigid3(double frame)>;

/// Camera and wall while a frame is taken.
struct FrameView {
  int index = 0;  // of the frame
  RowPoses camera;
  std::function<Rigid3(double offset_s)> pose_at;  // at other times; empty: not known
  std::shared_ptr<const Wall> wall;                // null: the wall at rest
  double fps = 0.0;  // one beat of the wall is the time between two frames

  double beat(double offset_s) const { return offset_s * fps; }
  /// What the sharp frame's rows see: one instant for all of them, or one for each.
  std::vector<Instant> instants(int height) const;
};

struct MotionOptions {
  int frames = 0;
  double fps = 0.0;
  int height = 0;             // rows
  double row_time_s = 0.0;    // 0: global shutter
  bool moves_within = false;  // the frame is exposed over time, not in an instant
  int in_flight = 4;          // frames worked on at a time
};

/// Safe to use from many threads at once.
///
/// The wall's vertices are found at the frames' times, as the wall at rest plus a displacement
/// rounded to kDisplacementStep_mm, and move on straight lines at constant speed between two
/// frames. Before the first and after the last frame they stand still, as the camera does.
class SceneMotion {
 public:
  /// `rest` must outlive it. `motion` may be empty.
  SceneMotion(const Wall& rest, WallMotion motion, CameraPath path, const MotionOptions& options);

  FrameView view(int frame) const;
  /// Where the wall's vertices are at a frame's time, less their places at rest; empty when it
  /// keeps still. Exact: place = rest + displacement in double precision.
  std::vector<Vec3f> displacement_mm(int frame) const;

  static constexpr double kDisplacementStep_mm = 0x1p-16;  // 15 nm
  static constexpr double kMostDisplacement_mm = 128.0;    // a float holds every step up to it

 private:
  template <typename T>
  struct Cache;  // the last few of a list of costly things

  Positions positions(int frame) const;
  std::shared_ptr<const Wall> wall(int frame) const;

  const Wall& rest_;
  WallMotion motion_;
  CameraPath path_;
  MotionOptions options_;
  std::shared_ptr<Cache<std::vector<Vec3>>> positions_;
  std::shared_ptr<Cache<Wall>> walls_;
};

}  // namespace rugae
