#include "core/mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "core/check.h"
#include "core/portable_math.h"

namespace rugae {
namespace {

using Edge = std::pair<int, int>;

struct DirectedUse {
  int forward = 0, backward = 0;  // along (low, high) and against it
};

Edge sorted_edge(int a, int b) { return a < b ? Edge{a, b} : Edge{b, a}; }

std::vector<std::pair<Edge, int>> sorted_edges_with_triangles(const TriangleMesh& mesh) {
  std::vector<std::pair<Edge, int>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      edges.emplace_back(sorted_edge(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]),
                         static_cast<int>(t));
  std::sort(edges.begin(), edges.end());
  return edges;
}

bool runs_forward(const Vec3i& triangle, const Edge& edge) {
  for (int k = 0; k < 3; ++k)
    if (triangle[k] == edge.first && triangle[(k + 1) % 3] == edge.second) return true;
  return false;
}

int find_root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

void check_mesh(const TriangleMesh& mesh, const std::string& name) {
  check(!mesh.triangles.empty(), "{}: no triangles", name);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    check(mesh.vertices[v].allFinite(), "{}: vertex {} is not finite ({}, {}, {})", name, v,
          mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z());
  const int count = static_cast<int>(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3i& i = mesh.triangles[t];
    check(i.minCoeff() >= 0 && i.maxCoeff() < count,
          "{}: triangle {} uses vertex {}, expected 0 to {}", name, t,
          i.minCoeff() < 0 ? i.minCoeff() : i.maxCoeff(), count - 1);
  }
}

Vec3 triangle_normal(const TriangleMesh& mesh, std::size_t t) {
  const Vec3i& i = mesh.triangles[t];
  const Vec3& a = mesh.vertices[i[0]];
  const Vec3 n = (mesh.vertices[i[1]] - a).cross(mesh.vertices[i[2]] - a);
  const double norm = n.norm();
  return norm > 0.0 ? Vec3(n / norm) : Vec3(Vec3::Zero());
}

double triangle_area_mm2(const TriangleMesh& mesh, std::size_t t) {
  const Vec3i& i = mesh.triangles[t];
  const Vec3& a = mesh.vertices[i[0]];
  return 0.5 * (mesh.vertices[i[1]] - a).cross(mesh.vertices[i[2]] - a).norm();
}

double signed_volume_mm3(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0.0;
  const Vec3 origin = mesh.vertices.front();  // near the mesh, to lose no digits
  double sum = 0.0;
  for (const Vec3i& i : mesh.triangles)
    sum += (mesh.vertices[i[0]] - origin)
               .dot((mesh.vertices[i[1]] - origin).cross(mesh.vertices[i[2]] - origin));
  return sum / 6.0;
}

double area_mm2(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += triangle_area_mm2(mesh, t);
  return sum;
}

Eigen::AlignedBox3d bounding_box(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  return box;
}

std::vector<Vec3f> angle_weighted_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> sums(mesh.vertices.size(), Vec3::Zero());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3i& i = mesh.triangles[t];
    const Vec3 n = triangle_normal(mesh, t);
    for (int k = 0; k < 3; ++k) {
      const Vec3 u = mesh.vertices[i[(k + 1) % 3]] - mesh.vertices[i[k]];
      const Vec3 v = mesh.vertices[i[(k + 2) % 3]] - mesh.vertices[i[k]];
      sums[i[k]] += portable_atan2(u.cross(v).norm(), u.dot(v)) * n;
    }
  }
  std::vector<Vec3f> normals(sums.size());
  std::transform(sums.begin(), sums.end(), normals.begin(),
                 [](const Vec3& n) -> Vec3f { return n.stableNormalized().cast<float>(); });
  return normals;
}

EdgeReport inspect_edges(const TriangleMesh& mesh) {
  EdgeReport report;
  const auto edges = sorted_edges_with_triangles(mesh);
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin;
    int forward = 0;
    for (; end < edges.size() && edges[end].first == edges[begin].first; ++end)
      forward += runs_forward(mesh.triangles[edges[end].second], edges[begin].first) ? 1 : 0;
    const std::size_t uses = end - begin;
    if (uses == 1) ++report.open;
    if (uses > 2) ++report.non_manifold;
    if (uses == 2 && forward != 1) ++report.flipped;
    begin = end;
  }
  return report;
}

std::vector<Vec3i> edge_neighbours(const TriangleMesh& mesh) {
  std::vector<Vec3i> across(mesh.triangles.size(), Vec3i::Constant(-1));
  const auto edges = sorted_edges_with_triangles(mesh);
  const auto slot = [&](int triangle, const Edge& edge) -> int& {
    const Vec3i& i = mesh.triangles[triangle];
    for (int k = 0; k < 2; ++k)
      if (sorted_edge(i[k], i[k + 1]) == edge) return across[triangle][k];
    return across[triangle][2];
  };
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin + 1;
    while (end < edges.size() && edges[end].first == edges[begin].first) ++end;
    if (end - begin == 2) {
      slot(edges[begin].second, edges[begin].first) = edges[begin + 1].second;
      slot(edges[begin + 1].second, edges[begin].first) = edges[begin].second;
    }
    begin = end;
  }
  return across;
}

std::vector<std::vector<int>> connected_components(const TriangleMesh& mesh) {
  std::vector<int> parent(mesh.triangles.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto edges = sorted_edges_with_triangles(mesh);
  for (std::size_t e = 1; e < edges.size(); ++e)
    if (edges[e].first == edges[e - 1].first) {
      const int a = find_root(parent, edges[e - 1].second), b = find_root(parent, edges[e].second);
      parent[std::max(a, b)] = std::min(a, b);
    }
  std::map<int, std::vector<int>> groups;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    groups[find_root(parent, static_cast<int>(t))].push_back(static_cast<int>(t));
  std::vector<std::vector<int>> components;
  for (auto& [root, members] : groups) components.push_back(std::move(members));
  std::stable_sort(components.begin(), components.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return components;
}

TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {a, {1, 0, 0}};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {b, {0, 1, 0}};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double v = d1 / (d1 - d3);
    return {a + v * ab, {1 - v, v, 0}};
  }
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {c, {0, 0, 1}};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double w = d2 / (d2 - d6);
    return {a + w * ac, {1 - w, 0, w}};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {b + w * (c - b), {0, 1 - w, w}};
  }
  const double sum = va + vb + vc, v = vb / sum, w = vc / sum;
  return {a + v * ab + w * ac, {1 - v - w, v, w}};
}

}  // namespace rugae
