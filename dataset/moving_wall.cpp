#include "dataset/moving_wall.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "dataset/truth.h"

namespace rugae {
namespace {

constexpr double kReach_mm = 1.0;  // farther away a point does not lie on the wall

// Cells of a grid of `kReach_mm`: those that hold something and all around these.
class NearCells {
 public:
  void add(const Vec3& low, const Vec3& high) {
    if (everywhere_ || !low.allFinite() || !high.allFinite()) return;
    const Cell a = cell(low) - Cell::Ones(), b = cell(high) + Cell::Ones();
    if (many(a, b)) {
      everywhere_ = true;
      return;
    }
    for (long x = a[0]; x <= b[0]; ++x)
      for (long y = a[1]; y <= b[1]; ++y)
        for (long z = a[2]; z <= b[2]; ++z) cells_.insert(key({x, y, z}));
  }
  // True for boxes that are very large.
  bool touch(const Vec3& low, const Vec3& high) const {
    if (everywhere_) return true;
    const Cell a = cell(low), b = cell(high);
    if (many(a, b)) return true;
    for (long x = a[0]; x <= b[0]; ++x)
      for (long y = a[1]; y <= b[1]; ++y)
        for (long z = a[2]; z <= b[2]; ++z)
          if (cells_.contains(key({x, y, z}))) return true;
    return false;
  }

 private:
  using Cell = Eigen::Matrix<long, 3, 1>;
  static Cell cell(const Vec3& p) {
    // beyond a kilometre there is no wall
    constexpr double kFar = 1e6;
    return (p / kReach_mm).cwiseMax(-kFar).cwiseMin(kFar).array().floor().cast<long>().matrix();
  }
  static bool many(const Cell& a, const Cell& b) {
    constexpr double kMany = 1000.0;
    return (b - a + Cell::Ones()).cast<double>().prod() > kMany;
  }
  static std::uint64_t key(const Cell& c) {
    constexpr long kHalf = 1 << 20;
    return static_cast<std::uint64_t>(c[0] + kHalf) << 42 |
           static_cast<std::uint64_t>(c[1] + kHalf) << 21 |
           static_cast<std::uint64_t>(c[2] + kHalf);
  }
  std::unordered_set<std::uint64_t> cells_;
  bool everywhere_ = false;
};

struct Box {
  Vec3 low, high;
};

Box box_of(const std::vector<Vec3>& vertices, const Vec3i& triangle) {
  const Vec3 &a = vertices[static_cast<std::size_t>(triangle[0])],
             &b = vertices[static_cast<std::size_t>(triangle[1])],
             &c = vertices[static_cast<std::size_t>(triangle[2])];
  return {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
}

}  // namespace

struct MovingWall::Lookup {
  NearCells cells;  // outside them there is no wall within reach
  TriangleMesh part;
  std::vector<int> triangles;  // of the part, in the whole wall
  std::unique_ptr<ClosestPoint> closest;
};

MovingWall::MovingWall(const DatasetLayout& layout, const TriangleMesh& rest, int frames, int index)
    : layout_(layout), rest_(rest), last_(frames - 1), index_(index) {}
MovingWall::~MovingWall() = default;

const std::vector<Vec3>& MovingWall::vertices(int frame) {
  frame = std::clamp(frame, 0, last_);
  const auto [at, fresh] = vertices_.try_emplace(frame);
  if (fresh) at->second = moved_wall(rest_, layout_.wall_motion(frame)).vertices;
  return at->second;
}

Vec3 MovingWall::at(const WallPoint& point, double frame) {
  if (!(point.triangle >= 0 && point.triangle < static_cast<int>(rest_.triangles.size())))
    return Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  const Vec3i& t = rest_.triangles[static_cast<std::size_t>(point.triangle)];
  const int before = static_cast<int>(std::floor(frame));
  const double share = frame - before;
  const std::vector<Vec3>&a = vertices(before), &b = vertices(share > 0.0 ? before + 1 : before);
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const auto v = static_cast<std::size_t>(t[k]);
    sum += point.barycentric[k] * ((1.0 - share) * a[v] + share * b[v]);
  }
  return sum;
}

WallPoint MovingWall::under(const Vec3& p_world, double frame) {
  if (!p_world.allFinite() || !lookup_ || !lookup_->closest) return {};
  // The lookup knows the wall at the frame's own time: what has moved since is taken off, as the
  // point found so far has moved.
  WallPoint found;
  Vec3 moved = Vec3::Zero();
  double off_mm = 0.0;
  constexpr int kSteps = 4;
  for (int step = 0; step < kSteps; ++step) {
    const Vec3 p = p_world - moved;
    if (!lookup_->cells.touch(p, p)) return {};
    const SurfacePoint s = (*lookup_->closest)(p);
    found = {lookup_->triangles.empty() ? s.triangle
                                        : lookup_->triangles[static_cast<std::size_t>(s.triangle)],
             s.barycentric};
    off_mm = s.distance_mm;
    if (frame == static_cast<double>(index_) || off_mm > kReach_mm) break;
    const Vec3 next = at(found, frame) - at(found, index_);
    constexpr double kSettled_mm = 1e-9;
    const bool settled = (next - moved).norm() <= kSettled_mm;
    moved = next;
    if (settled) break;
  }
  return off_mm <= kReach_mm ? found : WallPoint{};
}

void MovingWall::look_near(const std::vector<Vec3>& points) {
  lookup_ = std::make_unique<Lookup>();
  for (const Vec3& p : points) lookup_->cells.add(p, p);
  TriangleMesh& part = lookup_->part;
  part.vertices = vertices(index_);
  for (std::size_t t = 0; t < rest_.triangles.size(); ++t) {
    const Vec3i& corners = rest_.triangles[t];
    const Box box = box_of(part.vertices, corners);
    if (!lookup_->cells.touch(box.low, box.high)) continue;
    part.triangles.push_back(corners);
    lookup_->triangles.push_back(static_cast<int>(t));
  }
  if (!part.empty()) lookup_->closest = std::make_unique<ClosestPoint>(part);
}

void MovingWall::look_everywhere() {
  lookup_ = std::make_unique<Lookup>();
  lookup_->part.vertices = vertices(index_);
  lookup_->part.triangles = rest_.triangles;
  for (const Vec3i& triangle : rest_.triangles) {
    const Box box = box_of(lookup_->part.vertices, triangle);
    lookup_->cells.add(box.low, box.high);
  }
  lookup_->closest = std::make_unique<ClosestPoint>(lookup_->part);
}

}  // namespace rugae
