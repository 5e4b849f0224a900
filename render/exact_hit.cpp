#include "render/exact_hit.h"

#include <algorithm>
#include <cmath>

namespace rugae {
namespace {

// Nearer than this to an edge (in barycentric coordinates) the neighbours are asked as well. Single
// precision places a hit to about 1e-6 of the distance to the camera (0.1 um at 100 mm), and
// triangles are wider than 0.1 mm, so rounding moves it by about 1e-3 of a triangle.
constexpr double kNearEdge = 4e-3;
// Two hits nearer to each other than this share of the range are one place on a shared edge.
constexpr double kSamePlace = 1e-12;

}  // namespace

ExactHit::ExactHit(const TriangleMesh& mesh)
    : mesh_(&mesh), first_of_vertex_(mesh.vertices.size() + 1, 0) {
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++first_of_vertex_[t[k] + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    first_of_vertex_[v + 1] += first_of_vertex_[v];
  triangles_of_vertex_.resize(3 * mesh.triangles.size());
  std::vector<int> next(first_of_vertex_.begin(), first_of_vertex_.end() - 1);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k)
      triangles_of_vertex_[next[mesh.triangles[i][k]]++] = static_cast<int>(i);
}

// With corners a, b, c relative to the origin, the volumes d . (c x b), d . (a x c), d . (b x a)
// are the barycentric coordinates times their sum. The volume of an edge changes exactly its sign,
// and nothing else, for the triangle on its other side: no ray slips between two neighbours
// (Davidovic et al., 3D rasterization: a bridge between rasterization and ray casting, 2012).
ExactHit::Meeting ExactHit::meet(const Vec3& origin, const Vec3& direction, int triangle) const {
  const Vec3i& t = mesh_->triangles[triangle];
  const Vec3 a = mesh_->vertices[t[0]] - origin, b = mesh_->vertices[t[1]] - origin,
             c = mesh_->vertices[t[2]] - origin;
  const double u = direction.dot(c.cross(b)), v = direction.dot(a.cross(c)),
               w = direction.dot(b.cross(a));
  const double inverse = 1.0 / (u + v + w);
  const Vec3 normal = (b - a).cross(c - a);
  return {normal.dot(a) / normal.dot(direction), u * inverse, v * inverse, w * inverse};
}

Hit ExactHit::operator()(const Vec3& origin, const Vec3& direction, int proposed) const {
  const Meeting first = meet(origin, direction, proposed);
  const auto as_hit = [](int triangle, const Meeting& m) {
    return Hit{triangle, m.range_mm, static_cast<float>(std::clamp(m.b1, 0.0, 1.0)),
               static_cast<float>(std::clamp(m.b2, 0.0, 1.0))};
  };
  if (std::min({first.b0, first.b1, first.b2}) > kNearEdge) return as_hit(proposed, first);

  int best = -1;
  Meeting best_meeting = first;
  for (int k = 0; k < 3; ++k) {
    const int vertex = mesh_->triangles[proposed][k];
    for (int i = first_of_vertex_[vertex]; i < first_of_vertex_[vertex + 1]; ++i) {
      const int triangle = triangles_of_vertex_[i];
      const Meeting m = meet(origin, direction, triangle);
      // Written so that the not-a-number of a triangle seen edge-on is no hit.
      if (!(m.b0 >= 0.0 && m.b1 >= 0.0 && m.b2 >= 0.0 && m.range_mm > 0.0)) continue;
      const double slack = kSamePlace * m.range_mm;
      const bool nearer = best < 0 || m.range_mm < best_meeting.range_mm - slack;
      const bool tie = best >= 0 && std::abs(m.range_mm - best_meeting.range_mm) <= slack;
      if (nearer || (tie && triangle < best)) {
        best = triangle;
        best_meeting = m;
      }
    }
  }
  if (best >= 0) return as_hit(best, best_meeting);
  // The exact ray passes the outline within the traversal's rounding: the plane of the proposed
  // triangle is met at most that far outside of it, unless the plane is seen edge-on.
  if (!std::isfinite(first.range_mm) || !(first.range_mm > 0.0)) return {};
  return as_hit(proposed, first);
}

}  // namespace rugae
