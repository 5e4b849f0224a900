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

/// Turns a proposed triangle into a hit that does not depend on how it was found: where the
/// rounding of the traversal decides which of several triangles is proposed, the nearest of those
/// that the ray truly meets is taken, and of equally near ones the one of the lowest index. A
/// proposal beside which the ray passes is no hit.
class ExactHit {
 public:
  /// Keeps a reference: the mesh must outlive it. Proposals may lie beside the ray by `slack_mm`.
  ExactHit(const TriangleMesh& mesh, double slack_mm);
  /// The triangles of `other` with vertices that are elsewhere or move.
  ExactHit(const ExactHit& other, const VertexMotion& vertices);

  /// The hit of the ray origin + t direction, sent at `beat`, at the proposed triangle or near it;
  /// none where the ray passes an outline there. The range is t: mm for a unit direction.
  Hit operator()(const Vec3& origin, const Vec3& direction, double beat, int proposed) const;

 private:
  struct Ray;
  struct Meeting;
  struct Around {  // the triangles around a vertex
    std::vector<int> first_of_vertex, triangles_of_vertex;
  };
  Meeting meet(const Ray& ray, int triangle) const;
  template <int kZ>
  Meeting meet_along(const Ray& ray, int triangle) const;
  bool passes_near(const Ray& ray, int triangle, double distance_mm) const;
  template <typename Visit>
  void for_each_around(int vertex, const Visit& visit) const;
  Hit nearest_around(const Ray& ray, int vertex) const;
  Hit nearest_within_slack(const Ray& ray, int triangle) const;

  const std::vector<Vec3i>* triangles_;
  VertexMotion vertices_;
  double slack_mm_;
  std::shared_ptr<const Around> around_;
};

}  // namespace rugae
