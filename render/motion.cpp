#include "render/motion.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace rugae {

// The last `kept` entries. Every entry is made once while it is kept; whoever needs one that is
// being made waits for it.
template <typename T>
struct SceneMotion::Cache {
  struct Entry {
    std::mutex mutex;
    std::shared_ptr<const T> value;
  };
  std::mutex mutex;
  std::map<int, std::shared_ptr<Entry>> entries;
  std::vector<int> order;  // oldest first
  std::size_t kept;

  template <typename Make>
  std::shared_ptr<const T> get(int frame, const Make& make) {
    std::shared_ptr<Entry> entry;
    {
      const std::lock_guard lock(mutex);
      auto& slot = entries[frame];
      if (!slot) slot = std::make_shared<Entry>();
      entry = slot;
      std::erase(order, frame);
      order.push_back(frame);
      if (order.size() > kept) {
        entries.erase(order.front());
        order.erase(order.begin());
      }
    }
    const std::lock_guard lock(entry->mutex);
    // A thread that waits for the making's own tasks must not take up a frame that waits for this
    // entry.
    if (!entry->value) tbb::this_task_arena::isolate([&] { entry->value = make(); });
    return entry->value;
  }
};

std::vector<Instant> FrameView::instants(int height) const {
  const auto instant = [&](const Rigid3& pose, double offset_s) -> Instant {
    return {pose.rotation.toRotationMatrix(), pose.translation, beat(offset_s)};
  };
  if (!camera.rolling()) return {instant(camera.of_row(0), 0.0)};
  std::vector<Instant> rows;
  for (int y = 0; y < height; ++y)
    rows.push_back(instant(camera.of_row(y), camera.offset_s(y + 0.5)));
  return rows;
}

SceneMotion::SceneMotion(const Wall& rest, WallMotion motion, CameraPath path,
                         const MotionOptions& options)
    : rest_(rest),
      motion_(std::move(motion)),
      path_(std::move(path)),
      options_(options),
      positions_(std::make_shared<Cache<std::vector<Vec3>>>()),
      walls_(std::make_shared<Cache<Wall>>()) {
  constexpr int kNeighbours =
      4;  // a frame asks for the frames beside it, and their walls for theirs
  positions_->kept = walls_->kept = static_cast<std::size_t>(options.in_flight + kNeighbours);
  check(options.frames >= 1 && options.fps > 0.0 && options.height >= 1 &&
            options.row_time_s >= 0.0 && options.row_time_s * options.height * options.fps <= 1.001,
        "motion: {} frames of {} rows at {} frames a second, {} s a row; expected a readout within "
        "the frame's time",
        options.frames, options.height, options.fps, options.row_time_s);
}

Positions SceneMotion::positions(int frame) const {
  const int held = std::clamp(frame, 0, options_.frames - 1);
  return positions_->get(held, [&] {
    const std::vector<Vec3>& rest = rest_.surface().wall().vertices;
    auto moved = std::make_shared<std::vector<Vec3>>(rest);
    motion_(held / options_.fps, *moved);
    check(moved->size() == rest.size(), "the wall's motion gives {} vertices, expected {}",
          moved->size(), rest.size());
    for (std::size_t v = 0; v < rest.size(); ++v)
      for (int k = 0; k < 3; ++k) {
        const double away = (*moved)[v][k] - rest[v][k];
        check(std::abs(away) <= kMostDisplacement_mm,
              "at {} s vertex {} of the wall is {} mm from its place at rest, expected at most {}",
              held / options_.fps, v, away, kMostDisplacement_mm);
        (*moved)[v][k] =
            rest[v][k] + std::nearbyint(away / kDisplacementStep_mm) * kDisplacementStep_mm;
      }
    return moved;
  });
}

std::shared_ptr<const Wall> SceneMotion::wall(int frame) const {
  return walls_->get(frame, [&]() -> std::shared_ptr<const Wall> {
    const bool within = options_.row_time_s > 0.0 || options_.moves_within;
    return std::make_shared<const Wall>(rest_, positions(frame),
                                        within ? positions(frame - 1) : nullptr,
                                        within ? positions(frame + 1) : nullptr);
  });
}

FrameView SceneMotion::view(int frame) const {
  FrameView view;
  view.index = frame;
  view.fps = options_.fps;
  view.pose_at = [path = path_, frame, fps = options_.fps](double offset_s) {
    return path(frame + offset_s * fps);
  };
  if (motion_) view.wall = wall(frame);
  if (options_.row_time_s > 0.0) {
    std::vector<Rigid3> poses;
    for (int row = -1; row <= options_.height; ++row)
      poses.push_back(
          path_(frame + (row + 0.5 - 0.5 * options_.height) * options_.row_time_s * options_.fps));
    view.camera = RowPoses(std::move(poses), options_.row_time_s);
  } else {
    view.camera = RowPoses(path_(frame));
  }
  return view;
}

std::vector<Vec3f> SceneMotion::displacement_mm(int frame) const {
  if (!motion_) return {};
  const Positions now = positions(frame);
  const std::vector<Vec3>& rest = rest_.surface().wall().vertices;
  std::vector<Vec3f> away(rest.size());
  for (std::size_t v = 0; v < rest.size(); ++v) away[v] = ((*now)[v] - rest[v]).cast<float>();
  return away;
}

}  // namespace rugae
