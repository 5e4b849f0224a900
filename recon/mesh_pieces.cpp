#include "recon/mesh_pieces.h"

#include <algorithm>

namespace rugae {

std::vector<int> vertices_of_large_pieces(const TriangleMesh& mesh, double smallest_share) {
  const auto pieces = connected_components(mesh);
  if (pieces.empty()) return {};
  const double smallest = smallest_share * static_cast<double>(pieces.front().size());
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& piece : pieces)
    if (static_cast<double>(piece.size()) >= smallest)
      for (const int t : piece)
        for (int c = 0; c < 3; ++c) used[mesh.triangles[t][c]] = true;
  std::vector<int> vertices;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) vertices.push_back(static_cast<int>(v));
  return vertices;
}

TriangleMesh part_of(const TriangleMesh& mesh, const std::vector<int>& vertices) {
  std::vector<int> renumbered(mesh.vertices.size(), -1);
  TriangleMesh part;
  for (const int v : vertices) {
    renumbered[v] = static_cast<int>(part.vertices.size());
    part.vertices.push_back(mesh.vertices[v]);
    if (!mesh.normals.empty()) part.normals.push_back(mesh.normals[v]);
    if (!mesh.colors.empty()) part.colors.push_back(mesh.colors[v]);
    if (!mesh.sigma.empty()) part.sigma.push_back(mesh.sigma[v]);
  }
  for (const Vec3i& t : mesh.triangles) {
    const Vec3i corners(renumbered[t[0]], renumbered[t[1]], renumbered[t[2]]);
    if (corners.minCoeff() >= 0) part.triangles.push_back(corners);
  }
  return part;
}

}  // namespace rugae
