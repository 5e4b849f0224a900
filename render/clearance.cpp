#include "render/clearance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"
#include "scenes/mesh_repair.h"

namespace rugae {
namespace {

// Signed distance to the wall, mm, positive inside. The closest point lies in a triangle with a
// corner at most one edge farther away than the closest vertex; the triangles that share its edge
// or corner, which its pseudonormal takes, within another edge. So that piece of the wall is
// enough.
double depth_mm(const TriangleMesh& wall, const Vec3& p) {
  double closest2 = std::numeric_limits<double>::infinity(), edge2 = 0.0;
  for (const Vec3& v : wall.vertices) closest2 = std::min(closest2, (v - p).squaredNorm());
  for (const Vec3i& t : wall.triangles)
    for (int k = 0; k < 3; ++k)
      edge2 = std::max(edge2, (wall.vertices[t[k]] - wall.vertices[t[(k + 1) % 3]]).squaredNorm());
  const double reach_mm = std::sqrt(closest2) + 2.0 * std::sqrt(edge2);
  const auto near = [&](int v) {
    return (wall.vertices[v] - p).squaredNorm() <= reach_mm * reach_mm;
  };
  std::vector<int> piece;
  for (std::size_t t = 0; t < wall.triangles.size(); ++t) {
    const Vec3i& i = wall.triangles[t];
    if (near(i[0]) || near(i[1]) || near(i[2])) piece.push_back(static_cast<int>(t));
  }
  const TriangleMesh close = piece_of(wall, piece);
  return -ClosestPoint(close).signed_distance_mm(p);
}

}  // namespace

void check_moving_clearance(const Scene& scene, const PoseTrack& track, double clearance_mm,
                            const std::string& name) {
  if (!scene.motion) return;
  const ClosestPoint at_rest(scene.wall);
  std::vector<double> depths_mm(track.size());
  tbb::parallel_for(std::size_t{0}, track.size(), [&](std::size_t i) {
    const Vec3& p = track[i].world_from_camera.translation;
    // the wall comes nearer by its reach at most: most poses need no more than that
    depths_mm[i] = -at_rest.signed_distance_mm(p) - scene.motion_reach_mm;
    if (depths_mm[i] >= clearance_mm) return;
    TriangleMesh wall;
    scene.motion(track[i].time_s, wall.vertices);
    wall.triangles = scene.wall.triangles;
    depths_mm[i] = depth_mm(wall, p);
  });
  for (std::size_t i = 0; i < track.size(); ++i)
    check(depths_mm[i] >= clearance_mm,
          "{}: at frame {} ({:.2f} s) the moving wall is {:.2f} mm from the camera{}, expected at "
          "least {} mm inside; move the wall less, or plan with more clearance",
          name, i, track[i].time_s, std::abs(depths_mm[i]),
          depths_mm[i] < 0.0 ? ", which is outside" : "", clearance_mm);
}

}  // namespace rugae
