#include "studies/simplify.h"

#include <open3d/geometry/TriangleMesh.h>

#include <limits>

namespace rugae {

TriangleMesh simplified(const TriangleMesh& mesh, std::size_t triangles) {
  if (mesh.triangles.size() <= triangles) return {mesh.vertices, mesh.triangles, {}, {}, {}};
  const open3d::geometry::TriangleMesh full(mesh.vertices, mesh.triangles);
  constexpr double kAnyError = std::numeric_limits<double>::infinity(), kBoundaryWeight = 1.0;
  const auto few =
      full.SimplifyQuadricDecimation(static_cast<int>(triangles), kAnyError, kBoundaryWeight);
  few->RemoveDegenerateTriangles();
  few->RemoveUnreferencedVertices();
  return {few->vertices_, few->triangles_, {}, {}, {}};
}

}  // namespace rugae
