#pragma once
// Where a ray meets a triangle mesh, in double precision, given a triangle that a single-precision
// traversal proposes.

#include <vector>

#include "core/mesh.h"

namespace rugae {

struct Hit {
  int triangle = -1;           // -1: nothing was met
  double range_mm = 0.0;       // along the unit ray
  float b1 = 0.0f, b2 = 0.0f;  // barycentric coordinates of the triangle's second and third corner

  bool met() const { return triangle >= 0; }
};

/// Turns a proposed triangle into a hit that does not depend on how it was found: on an edge or a
/// corner, where the rounding of the traversal decides which of the neighbours is proposed, the
/// nearest of the triangles that the ray truly meets is taken, and of equally near ones the one of
/// the lowest index.
class ExactHit {
 public:
  explicit ExactHit(const TriangleMesh& mesh);  // keeps a reference: the mesh must outlive it

  /// The hit of the ray origin + t direction (unit) at the proposed triangle or a neighbour. Where
  /// the exact ray misses all of them, past an outline: the next point of the proposed triangle, or
  /// no hit when `strictly`.
  Hit operator()(const Vec3& origin, const Vec3& direction, int proposed,
                 bool strictly = false) const;

 private:
  struct Ray;
  struct Meeting {
    double range_mm;
    double b0, b1, b2;
  };
  Meeting meet(const Ray& ray, int triangle) const;
  Hit nearest_on(const Ray& ray, int triangle, const Meeting& meeting) const;

  const TriangleMesh* mesh_;
  std::vector<int> first_of_vertex_, triangles_of_vertex_;  // the triangles around a vertex
};

}  // namespace rugae
