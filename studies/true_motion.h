#pragma once
// Where what a pixel sees is in another frame: exact, at any place between pixels and over any
// number of frames, from the wall, the poses and nothing else.

#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "dataset/truth.h"
#include "render/raycaster.h"

namespace rugae {

struct TrueLanding {
  enum class Sight {
    seen,     // the wall point is in the other frame
    hidden,   // ... in its image, but turned away or behind other wall
    outside,  // ... beyond its image or field stop
    nowhere,  // the pixel meets no wall, or the other lens has no place for the point
  };
  Sight sight = Sight::nowhere;
  Vec2 pixel = Vec2::Zero();  // unless nowhere
};

/// The pixel's ray is met with the wall as it is at the time of the pixel's line; the point stays
/// on its triangle, and lands on the line whose time is that at which it is there. Hidden as the
/// flow labels have it (render/labels.h). No label image is read: nothing is interpolated, so an
/// edge of depth is as sharp as the wall's.
///
/// Keeps the wall, and of a moving one the last few frames'. Safe to use from many threads at once.
class TrueMotion {
 public:
  /// Throws Error for a dataset that is not whole.
  explicit TrueMotion(const std::filesystem::path& dataset);
  ~TrueMotion();

  const Truth& truth() const { return truth_; }
  /// In the order of the pixels, which are those of frame `from` as observed (distorted). Throws
  /// Error for frames that do not exist and walls that cannot be read.
  std::vector<TrueLanding> follow(int from, int to, std::span<const Vec2> pixels) const;
  /// z-depth, mm, of each ray (camera axes, z = 1) from the camera at the frame's time, to the wall
  /// as it is then; NaN where nothing is met.
  std::vector<double> depths_mm(int frame, std::span<const Vec3> rays) const;

 private:
  struct FrameWall;
  using Positions = std::shared_ptr<const std::vector<Vec3>>;
  template <typename T>
  using Kept = std::list<std::pair<int, std::shared_ptr<const T>>>;

  std::shared_ptr<const FrameWall> wall(int frame) const;
  Positions positions(int frame) const;
  template <typename T, typename Make>
  std::shared_ptr<const T> find(Kept<T>& kept, int frame, Make make) const;

  Truth truth_;
  LensProjector lens_;
  Raycaster at_rest_;
  bool moves_ = false;
  std::shared_ptr<const FrameWall> still_;  // where the wall does not move
  mutable std::mutex mutex_;                // of the lists
  mutable Kept<FrameWall> walls_;
  mutable Kept<std::vector<Vec3>> positions_;
};

}  // namespace rugae
