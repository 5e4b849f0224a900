#include "studies/map_over_truth.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "studies/frame_pictures.h"
#include "studies/gates.h"
#include "studies/plots.h"
#include "validate/align.h"
#include "validate/metrics_json.h"
#include "validate/surface_error.h"
#include "validate/wall_seen.h"

namespace rugae {
namespace {

// From at most this many frames, in equal steps: enough for a picture of what was seen.
Visibility visibility_of(const CellView& view) {
  constexpr int kMostFrames = 150;
  const Truth& truth = view.truth;
  const int step = (truth.size() + kMostFrames - 1) / kMostFrames;
  std::vector<int> frames;
  for (int i = 0; i < truth.size(); i += step)
    if (has_label(view, "depth", i)) frames.push_back(i);
  Progress progress(Progress::Output::silent);
  return wall_seen(truth, frames, progress);
}

// Triangles turned so that they face out of the organ, as the wall's do: seen by most of them,
// since a method may wind its map either way.
TriangleMesh facing_as(TriangleMesh map, const TriangleMesh& wall) {
  const ClosestPoint closest(wall);
  constexpr std::size_t kLookedAt = 2000;
  const std::size_t step = map.triangles.size() / kLookedAt + 1;
  double agreement = 0.0;
  for (std::size_t t = 0; t < map.triangles.size(); t += step) {
    const int beside = closest(map.vertices[map.triangles[t][0]]).triangle;
    agreement += triangle_normal(map, t).dot(triangle_normal(wall, beside));
  }
  if (agreement >= 0.0) return map;
  for (Vec3i& triangle : map.triangles) std::swap(triangle[1], triangle[2]);
  map.normals.clear();
  return map;
}

// Above 95 % of the errors.
double worst_of(std::vector<double> error_mm) {
  constexpr double kMost = 0.95;
  std::ranges::sort(error_mm);
  const double high = error_mm[static_cast<std::size_t>(kMost * (error_mm.size() - 1.0))];
  const double step = nice_step(std::max(high, 1e-6), 4);
  return step * std::max(1.0, std::ceil(high / step));
}

}  // namespace

MapOverTruth map_over_truth(const CellView& view) {
  MapOverTruth over{visibility_of(view), {}, {}, {}};
  over.seen_wall = over.visibility.seen_wall();
  const auto to_truth = transform_from_json(metric_at(view.cell.metrics, "alignment"));
  if (!to_truth || view.estimate.map.empty() || over.seen_wall.empty()) return over;
  over.map = facing_as(transformed(view.estimate.map, *to_truth), view.truth.wall());
  if (over.map.normals.empty()) over.map.normals = angle_weighted_normals(over.map);
  over.error_mm = distances_mm(over.map.vertices, over.seen_wall);
  over.worst_mm = worst_of(over.error_mm);
  return over;
}

}  // namespace rugae
