#include "trajectories/free_space.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "core/portable_math.h"

namespace rugae {
namespace {

// Grid points in the bounding box: steps of 4 mm in a stomach of 140 mm, fine enough to find its
// medial line, which is smoothed against the wall itself afterwards.
constexpr double kGridPoints = 25000.0;
constexpr double kFar = std::numeric_limits<double>::infinity();

struct Reached {
  std::vector<double> cost;
  std::vector<int> from;
};

/// Dijkstra's shortest paths from `start` over the grid points with cost_at > 0, 26 neighbours; an
/// edge costs its length times the mean of its ends' costs. Ties go to the smaller index.
Reached shortest_paths(const Vec3i& size, int start, const std::vector<double>& cost_at) {
  Reached reached{std::vector<double>(cost_at.size(), kFar), std::vector<int>(cost_at.size(), -1)};
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  reached.cost[start] = 0.0;
  queue.emplace(0.0, start);
  while (!queue.empty()) {
    const auto [cost, at] = queue.top();
    queue.pop();
    if (cost > reached.cost[at]) continue;
    const Vec3i cell(at % size.x(), at / size.x() % size.y(), at / (size.x() * size.y()));
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const Vec3i next = cell + Vec3i(dx, dy, dz);
          if ((next.array() < 0).any() || (next.array() >= size.array()).any()) continue;
          const int index = (next.z() * size.y() + next.y()) * size.x() + next.x();
          if (index == at || !(cost_at[index] > 0.0)) continue;
          const double length = std::sqrt(double(dx * dx + dy * dy + dz * dz));
          const double total = cost + 0.5 * length * (cost_at[at] + cost_at[index]);
          if (total < reached.cost[index]) {
            reached.cost[index] = total;
            reached.from[index] = at;
            queue.emplace(total, index);
          }
        }
  }
  return reached;
}

/// The reached point with the largest cost; the smallest index among equals.
int farthest(const Reached& reached) {
  int best = -1;
  for (std::size_t i = 0; i < reached.cost.size(); ++i)
    if (reached.cost[i] < kFar && (best < 0 || reached.cost[i] > reached.cost[best]))
      best = static_cast<int>(i);
  return best;
}

/// The largest part of `inside` that hangs together, by a point of it; -1 if nothing is inside.
int largest_part(const Vec3i& size, const std::vector<double>& inside) {
  std::vector<char> seen(inside.size(), 0);
  int best = -1;
  std::size_t best_count = 0;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (seen[i] || !(inside[i] > 0.0)) continue;
    const Reached part = shortest_paths(size, static_cast<int>(i), inside);
    std::size_t count = 0;
    for (std::size_t k = 0; k < inside.size(); ++k)
      if (part.cost[k] < kFar) seen[k] = 1, ++count;
    if (count > best_count) best_count = count, best = static_cast<int>(i);
  }
  return best;
}

}  // namespace

FreeSpace::FreeSpace(const TriangleMesh& wall) : wall_(wall) {
  const Eigen::AlignedBox3d box = bounding_box(wall);
  step_mm_ = portable_cbrt(box.volume() / kGridPoints);
  origin_ = box.min();
  size_ = (box.sizes() / step_mm_).array().ceil().cast<int>() + 1;
  depth_mm_.resize(static_cast<std::size_t>(size_.prod()));
  const int row = size_.x();
  tbb::parallel_for(tbb::blocked_range<int>(0, size_.y() * size_.z()), [&](const auto& rows) {
    for (int r = rows.begin(); r < rows.end(); ++r)
      for (int i = r * row; i < (r + 1) * row; ++i) {
        depth_mm_[i] = this->depth_mm(point(i));
        // d mm outside the wall, the next d mm of the row are outside too.
        const int end = (r + 1) * row;
        for (double d = -depth_mm_[i] - step_mm_; d > 0.0 && i + 1 < end; d -= step_mm_)
          depth_mm_[++i] = -d;
      }
  });
}

Vec3 FreeSpace::point(int index) const {
  const Vec3i cell(index % size_.x(), index / size_.x() % size_.y(),
                   index / (size_.x() * size_.y()));
  return origin_ + step_mm_ * cell.cast<double>();
}

Vec3 FreeSpace::widest_point() const {
  return point(static_cast<int>(std::ranges::max_element(depth_mm_) - depth_mm_.begin()));
}

double FreeSpace::widest_mm() const { return std::ranges::max(depth_mm_); }

Vec3 FreeSpace::away_from_wall(const Vec3& p) const {
  const Vec3 v = p - wall_(p).point;
  const double length = v.norm();
  if (!(length > 0.0)) return Vec3::Zero();
  return v / (depth_mm(p) < 0.0 ? -length : length);
}

std::vector<Vec3> resample(const std::vector<Vec3>& line, int count) {
  std::vector<double> upto{0.0};
  for (std::size_t i = 1; i < line.size(); ++i)
    upto.push_back(upto.back() + (line[i] - line[i - 1]).norm());
  std::vector<Vec3> points;
  std::size_t k = 1;
  for (int i = 0; i < count; ++i) {
    const double s = upto.back() * i / (count - 1);
    while (k + 1 < line.size() && upto[k] < s) ++k;
    const double step = upto[k] - upto[k - 1];
    const double t = step > 0.0 ? std::clamp((s - upto[k - 1]) / step, 0.0, 1.0) : 0.0;
    points.push_back((1.0 - t) * line[k - 1] + t * line[k]);
  }
  return points;
}

std::vector<Vec3> FreeSpace::medial_line(double depth_mm, int count) const {
  // Ways are first measured by plain length, to find the ends; then the way between the ends is
  // taken for which the medial axis is cheap: cost (widest / depth)^2 a mm.
  std::vector<double> inside(depth_mm_.size(), 0.0), medial(depth_mm_.size(), 0.0);
  const double widest = widest_mm();
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (!(depth_mm_[i] >= depth_mm)) continue;
    inside[i] = 1.0;
    medial[i] = (widest / depth_mm_[i]) * (widest / depth_mm_[i]);
  }
  const int anywhere = largest_part(size_, inside);
  if (anywhere < 0) return std::vector<Vec3>(count, widest_point());
  const int begin = farthest(shortest_paths(size_, anywhere, inside));
  const int end = farthest(shortest_paths(size_, begin, inside));
  const Reached reached = shortest_paths(size_, begin, medial);
  std::vector<Vec3> line;
  for (int at = end; at >= 0; at = reached.from[at]) line.push_back(point(at));
  if (line.size() < 2) line.push_back(line.front() + step_mm_ * Vec3::UnitX());

  // The grid's staircase is smoothed by moving every point towards its neighbours' middle, and
  // back into the deep where that brings it nearer to the wall than the way asks for.
  constexpr int kRounds = 200, kRoundsBetweenChecks = 10;
  line = resample(line, count);
  for (int round = 1; round <= kRounds; ++round) {
    std::vector<Vec3> next(line);
    for (int i = 1; i + 1 < count; ++i)
      next[i] = 0.25 * (line[i - 1] + 2.0 * line[i] + line[i + 1]);
    line = std::move(next);
    if (round % kRoundsBetweenChecks != 0) continue;
    for (int i = 1; i + 1 < count; ++i) {
      const double depth = this->depth_mm(line[i]);
      if (depth < depth_mm) line[i] += (depth_mm - depth) * away_from_wall(line[i]);
    }
    line = resample(line, count);
  }
  return line;
}

}  // namespace rugae
