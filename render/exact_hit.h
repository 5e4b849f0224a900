#pragma once
// Where a ray meets a triangle mesh, in double precision, given a triangle that a single-precision
// traversal proposes.

#include <memory>
#include <vector>

#include "core/mesh.h"
#include "render/vertex_motion.h"

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
  /// The triangles of `other` with vertices that are elsewhere or move.
  ExactHit(const ExactHit& other, const VertexMotion& vertices);

  /// The hit of the ray origin + t direction (unit), sent at `beat`, at the proposed triangle or a
  /// neighbour. Where the exact ray misses all of them, past an outline: the next point of the
  /// proposed triangle, or no hit when `strictly`.
  Hit operator()(const Vec3& origin, const Vec3& direction, double beat, int proposed,
                 bool strictly = false) const;

 private:
  struct Ray;
  struct Meeting {
    double range_mm;
    double b0, b1, b2;
  };
  struct Around {  // the triangles around a vertex
    std::vector<int> first_of_vertex, triangles_of_vertex;
  };
  Meeting meet(const Ray& ray, int triangle) const;
  Hit nearest_on(const Ray& ray, int triangle, const Meeting& meeting) const;

  const std::vector<Vec3i>* triangles_;
  VertexMotion vertices_;
  std::shared_ptr<const Around> around_;
};

}  // namespace rugae
