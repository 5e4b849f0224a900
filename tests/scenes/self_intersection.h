#pragma once
// Counts edges that pass through triangles they share no vertex with.

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "core/mesh.h"

namespace rugae {

/// Does the open segment from p to q pass through the triangle (Moeller and Trumbore 1997)?
inline bool passes_through(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b,
                           const Vec3& c) {
  const Vec3 d = q - p, e1 = b - a, e2 = c - a, h = d.cross(e2);
  const double det = e1.dot(h);
  if (std::abs(det) < 1e-14) return false;
  const Vec3 s = p - a;
  const double u = s.dot(h) / det;
  const Vec3 k = s.cross(e1);
  const double v = d.dot(k) / det, t = e2.dot(k) / det;
  return u > 0.0 && v > 0.0 && u + v < 1.0 && t > 0.0 && t < 1.0;
}

inline int self_intersections(const TriangleMesh& mesh) {
  double cell = 0.0;  // the longest edge: an edge and a triangle it crosses share a cell or touch
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      cell = std::max(cell, (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
  const auto key = [](int x, int y, int z) {
    return (static_cast<long long>(x) * 73856093) ^ (static_cast<long long>(y) * 19349663) ^
           (static_cast<long long>(z) * 83492791);
  };
  const auto cells_of = [&](const Vec3& low, const Vec3& high, auto&& visit) {
    for (int x = static_cast<int>(std::floor(low.x() / cell)); x <= std::floor(high.x() / cell);
         ++x)
      for (int y = static_cast<int>(std::floor(low.y() / cell)); y <= std::floor(high.y() / cell);
           ++y)
        for (int z = static_cast<int>(std::floor(low.z() / cell)); z <= std::floor(high.z() / cell);
             ++z)
          visit(key(x, y, z));
  };
  std::unordered_map<long long, std::vector<int>> grid;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3i& i = mesh.triangles[t];
    const Vec3 &a = mesh.vertices[i[0]], &b = mesh.vertices[i[1]], &c = mesh.vertices[i[2]];
    cells_of(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c),
             [&](long long k) { grid[k].push_back(static_cast<int>(t)); });
  }
  int count = 0;
  for (const Vec3i& e : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const int from = e[k], to = e[(k + 1) % 3];
      if (from > to) continue;  // its other triangle has it too
      const Vec3 &p = mesh.vertices[from], &q = mesh.vertices[to];
      cells_of(p.cwiseMin(q), p.cwiseMax(q), [&](long long where) {
        const auto found = grid.find(where);
        if (found == grid.end()) return;
        for (int t : found->second) {
          const Vec3i& i = mesh.triangles[t];
          if ((i.array() == from).any() || (i.array() == to).any()) continue;
          count +=
              passes_through(p, q, mesh.vertices[i[0]], mesh.vertices[i[1]], mesh.vertices[i[2]]);
        }
      });
    }
  return count;
}

}  // namespace rugae
