#pragma once
// What hangs in the air beside a map.

#include <vector>

#include "core/mesh.h"

namespace rugae {

/// The vertices that belong to pieces (triangles joined by edges) of at least `smallest_share` of
/// the largest one's triangles, in their order.
std::vector<int> vertices_of_large_pieces(const TriangleMesh& mesh, double smallest_share);

/// The mesh of these vertices alone, in their order: triangles with all corners among them.
TriangleMesh part_of(const TriangleMesh& mesh, const std::vector<int>& vertices);

}  // namespace rugae
