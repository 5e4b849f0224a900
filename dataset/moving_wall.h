#pragma once
// The wall of a dataset between its frames: every vertex moves on a straight line at constant
// speed, and stands still before the first and after the last frame.

#include <map>
#include <memory>
#include <vector>

#include "core/mesh.h"
#include "dataset/layout.h"

namespace rugae {

/// A point that stays on the wall; triangle -1: on none.
struct WallPoint {
  int triangle = -1;
  Vec3 barycentric = Vec3::Zero();
};

/// Times are in frames. Files are read when they are needed; not to be used by two threads at once.
class MovingWall {
 public:
  /// `rest` is truth/wall.ply and must outlive this. `index` is the frame around whose time points
  /// are looked for.
  MovingWall(const DatasetLayout& layout, const TriangleMesh& rest, int frames, int index);
  ~MovingWall();

  /// Where the point is; not a number for a point on no triangle.
  Vec3 at(const WallPoint& point, double frame);
  /// The point of the wall at `p_world` at a time less than a frame from `index`: the closest one.
  /// On none where the wall is farther away than a millimetre.
  WallPoint under(const Vec3& p_world, double frame);
  /// Makes `under` quick for points near these, and for these only, until `look_everywhere`.
  void look_near(const std::vector<Vec3>& points);
  void look_everywhere();

 private:
  struct Lookup;
  const std::vector<Vec3>& vertices(int frame);

  const DatasetLayout& layout_;
  const TriangleMesh& rest_;
  int last_, index_;
  std::map<int, std::vector<Vec3>> vertices_;
  std::unique_ptr<Lookup> lookup_;
};

}  // namespace rugae
