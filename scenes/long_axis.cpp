#include "scenes/long_axis.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <queue>

#include "core/check.h"

namespace rugae {
namespace {

constexpr int kBands = 14;
constexpr double kBallStepShare = 1.0 / 60.0;  // of the length
constexpr double kSoftnessShare = 1.0 / 50.0;

std::vector<double> distance_along_edges(const TriangleMesh& wall,
                                         const std::vector<std::vector<int>>& neighbours,
                                         int from) {
  std::vector<double> distance(wall.vertices.size(), 1e30);
  using Item = std::pair<double, int>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  distance[from] = 0.0;
  queue.emplace(0.0, from);
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > distance[v]) continue;
    for (int n : neighbours[v]) {
      const double through = d + (wall.vertices[n] - wall.vertices[v]).norm();
      if (through < distance[n]) {
        distance[n] = through;
        queue.emplace(through, n);
      }
    }
  }
  return distance;
}

int farthest(const std::vector<double>& distance) {
  int best = -1;
  for (std::size_t v = 0; v < distance.size(); ++v)
    if (distance[v] < 1e29 && (best < 0 || distance[v] > distance[best]))
      best = static_cast<int>(v);
  return best;
}

// Normal of the plane the axis lies in most nearly, pointing so that tangent x normal leads to the
// outside of the bend.
Vec3 bend_pole(const std::vector<AxisNode>& nodes) {
  Vec3 mean = Vec3::Zero();
  for (const AxisNode& n : nodes) mean += n.centre / static_cast<double>(nodes.size());
  Mat3 scatter = Mat3::Zero();
  for (const AxisNode& n : nodes) scatter += (n.centre - mean) * (n.centre - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(scatter);
  Vec3 pole = solver.eigenvectors().col(0);
  double outside = 0.0;
  for (std::size_t i = 1; i + 1 < nodes.size(); ++i) {
    const Vec3 tangent = nodes[i + 1].centre - nodes[i - 1].centre;
    const Vec3 inwards = nodes[i + 1].centre - 2.0 * nodes[i].centre + nodes[i - 1].centre;
    outside -= tangent.cross(pole).dot(inwards);
  }
  return outside < 0.0 ? Vec3(-pole) : pole;
}

}  // namespace

OrganAxis long_axis(const TriangleMesh& wall) {
  std::vector<std::vector<int>> neighbours(wall.vertices.size());
  for (const Vec3i& t : wall.triangles)
    for (int k = 0; k < 3; ++k) neighbours[t[k]].push_back(t[(k + 1) % 3]);
  const int start = farthest(distance_along_edges(wall, neighbours, wall.triangles[0][0]));
  const auto distance = distance_along_edges(wall, neighbours, start);
  const double longest = distance[farthest(distance)];

  std::vector<AxisNode> nodes(kBands, {Vec3::Zero(), 0.0});
  std::vector<double> weight(kBands, 0.0);
  const auto band_of = [&](std::size_t v) {
    return std::clamp(static_cast<int>(distance[v] / longest * kBands), 0, kBands - 1);
  };
  for (std::size_t v = 0; v < wall.vertices.size(); ++v) {
    if (!(distance[v] < 1e29)) continue;
    nodes[band_of(v)].centre += wall.vertices[v];
    weight[band_of(v)] += 1.0;
  }
  for (int b = 0; b < kBands; ++b) {
    check(weight[b] > 0.0, "long axis: the wall is too coarse to find its axis");
    nodes[b].centre /= weight[b];
  }
  for (std::size_t v = 0; v < wall.vertices.size(); ++v)
    if (distance[v] < 1e29) {
      AxisNode& node = nodes[band_of(v)];
      node.radius_mm += (wall.vertices[v] - node.centre).norm() / weight[band_of(v)];
    }
  // one round of smoothing: bands cut the wall at a slant where it bends
  std::vector<AxisNode> smooth = nodes;
  for (int b = 1; b + 1 < kBands; ++b) {
    smooth[b].centre =
        0.25 * nodes[b - 1].centre + 0.5 * nodes[b].centre + 0.25 * nodes[b + 1].centre;
    smooth[b].radius_mm =
        0.25 * nodes[b - 1].radius_mm + 0.5 * nodes[b].radius_mm + 0.25 * nodes[b + 1].radius_mm;
  }
  double first = 0.0, last = 0.0;
  for (int b = 0; b < kBands / 2; ++b) {
    first += smooth[b].radius_mm;
    last += smooth[kBands - 1 - b].radius_mm;
  }
  if (first < last) std::reverse(smooth.begin(), smooth.end());
  double length = 0.0;
  for (int b = 1; b < kBands; ++b) length += (smooth[b].centre - smooth[b - 1].centre).norm();
  return OrganAxis(smooth, kBallStepShare * length, kSoftnessShare * length, 1.0,
                   bend_pole(smooth));
}

}  // namespace rugae
