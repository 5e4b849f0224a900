#pragma once
// Meshes small enough for a page.

#include <cstddef>

#include "core/mesh.h"

namespace rugae {

/// The mesh with at most about `triangles` triangles and without normals and colours: quadric error
/// metrics (Garland and Heckbert, SIGGRAPH 1997, doi:10.1145/258734.258849), by Open3D. A mesh that
/// is small enough keeps its geometry.
TriangleMesh simplified(const TriangleMesh& mesh, std::size_t triangles);

}  // namespace rugae
