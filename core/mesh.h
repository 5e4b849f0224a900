#pragma once
// The triangle mesh everyone shares, and the closest point on it.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/types.h"

namespace rugae {

/// Vertices in mm. Closed organs wind so that geometric normals point OUT of the lumen (positive
/// volume); whoever looks from inside flips the normal towards the viewer. The optional arrays are
/// empty or as long as `vertices`.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<Vec3i> triangles;
  std::vector<Vec3f> normals;  // of vertices, unit
  std::vector<Vec3f> colors;   // of vertices, sRGB in [0, 1]
  std::vector<float> sigma;    // of vertices, standard deviation along the normal, mm

  bool empty() const { return triangles.empty(); }
};

/// Throws Error naming `name` when there are no triangles, an index is out of range, or a
/// coordinate is not finite.
void check_mesh(const TriangleMesh& mesh, const std::string& name);

/// Unit normal of triangle `t` by its winding; zero for a triangle without area.
Vec3 triangle_normal(const TriangleMesh& mesh, std::size_t t);
double triangle_area_mm2(const TriangleMesh& mesh, std::size_t t);
/// Enclosed volume of a closed mesh, mm^3; positive when normals point outward (divergence
/// theorem).
double signed_volume_mm3(const TriangleMesh& mesh);
double area_mm2(const TriangleMesh& mesh);
Eigen::AlignedBox3d bounding_box(const TriangleMesh& mesh);
/// Vertex normals: the mean of the adjacent triangles' normals weighted by the angle at the vertex
/// (Thuermer and Wuethrich 1998, doi:10.1080/10867651.1998.10487487).
std::vector<Vec3f> angle_weighted_normals(const TriangleMesh& mesh);
/// Number of edges used by other than two triangles, and of edges whose two triangles wind against
/// each other.
struct EdgeReport {
  std::size_t open = 0;          // used once
  std::size_t non_manifold = 0;  // used three times or more
  std::size_t flipped = 0;       // both triangles run along it in the same direction
  bool closed() const { return open == 0 && non_manifold == 0; }
};
EdgeReport inspect_edges(const TriangleMesh& mesh);
/// Of each triangle, the triangle beyond its edge k (from corner k to corner k + 1); -1 where the
/// edge is open or used by more than two triangles.
std::vector<Vec3i> edge_neighbours(const TriangleMesh& mesh);
/// Triangles grouped by edge connectivity; each entry is a component's triangle indices, largest
/// first.
std::vector<std::vector<int>> connected_components(const TriangleMesh& mesh);

/// Closest point on a triangle to p (Ericson, Real-Time Collision Detection, 2005, section 5.1.5),
/// with barycentric coordinates of corners a, b, c.
struct TrianglePoint {
  Vec3 point;
  Vec3 barycentric;
};
TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

struct SurfacePoint {
  Vec3 point;
  double distance_mm = 0.0;
  int triangle = -1;
  Vec3 barycentric;
};

/// Closest points on a mesh through a bounding-volume hierarchy; safe to query from many threads at
/// once.
class ClosestPoint {
 public:
  explicit ClosestPoint(const TriangleMesh& mesh);  // keeps a reference: the mesh must outlive it
  ~ClosestPoint();
  ClosestPoint(ClosestPoint&&) noexcept;

  SurfacePoint operator()(const Vec3& p) const;
  /// Negative inside a closed mesh, by the angle-weighted pseudonormal of the closest feature
  /// (Baerentzen and Aanaes, TVCG 2005, doi:10.1109/TVCG.2005.49).
  double signed_distance_mm(const Vec3& p) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace rugae
