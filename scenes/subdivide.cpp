#include "scenes/subdivide.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/check.h"

namespace rugae {
namespace {

// Corner k of triangle t faces the side from corner k+1 to corner k+2.
struct Side {
  std::uint64_t key;
  int triangle, corner;
};

// The vertices around each vertex, every one once: of a closed mesh, the heads of its half-edges.
struct Neighbours {
  std::vector<int> first, vertex;
};

Neighbours neighbours_of(const TriangleMesh& mesh) {
  Neighbours result;
  result.first.assign(mesh.vertices.size() + 1, 0);
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++result.first[t[k] + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) result.first[v + 1] += result.first[v];
  result.vertex.resize(3 * mesh.triangles.size());
  std::vector<int> fill(result.first.begin(), result.first.end() - 1);
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) result.vertex[fill[t[k]]++] = t[(k + 1) % 3];
  return result;
}

Vec3 sum_around(const TriangleMesh& mesh, const Neighbours& around, std::size_t v) {
  Vec3 sum = Vec3::Zero();
  for (int i = around.first[v]; i < around.first[v + 1]; ++i)
    sum += mesh.vertices[around.vertex[i]];
  return sum;
}

}  // namespace

TriangleMesh subdivide_loop(const TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][(k + 1) % 3], b = mesh.triangles[t][(k + 2) % 3];
      sides.push_back(
          {static_cast<std::uint64_t>(std::min(a, b)) << 32 | static_cast<unsigned>(std::max(a, b)),
           static_cast<int>(t), k});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
  });

  TriangleMesh out;
  const std::size_t old = mesh.vertices.size();
  out.vertices.resize(old + sides.size() / 2);
  const Neighbours around = neighbours_of(mesh);
  tbb::parallel_for(std::size_t{0}, old, [&](std::size_t v) {
    // an old vertex of n neighbours: (1 - n b) v + b sum, with Warren's b = 3 / (8 n), 3/16 for n=3
    const int n = around.first[v + 1] - around.first[v];
    const double b = n == 3 ? 3.0 / 16.0 : 3.0 / (8.0 * n);
    out.vertices[v] = (1.0 - n * b) * mesh.vertices[v] + b * sum_around(mesh, around, v);
  });
  std::vector<std::array<int, 3>> middle(mesh.triangles.size());
  for (std::size_t i = 0; i < sides.size(); i += 2) {
    check(i + 1 < sides.size() && sides[i].key == sides[i + 1].key &&
              (i + 2 >= sides.size() || sides[i + 2].key != sides[i].key),
          "subdivision: an edge without exactly two triangles");
    const int a = static_cast<int>(sides[i].key >> 32);
    const int b = static_cast<int>(sides[i].key & 0xFFFFFFFFu);
    const int c = mesh.triangles[sides[i].triangle][sides[i].corner];
    const int d = mesh.triangles[sides[i + 1].triangle][sides[i + 1].corner];
    const int m = static_cast<int>(old + i / 2);
    // a new vertex: 3/8 of the edge's ends, 1/8 of the corners facing it
    out.vertices[m] = 0.375 * (mesh.vertices[a] + mesh.vertices[b]) +
                      0.125 * (mesh.vertices[c] + mesh.vertices[d]);
    middle[sides[i].triangle][sides[i].corner] = m;
    middle[sides[i + 1].triangle][sides[i + 1].corner] = m;
  }
  out.triangles.reserve(4 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3i& v = mesh.triangles[t];
    const auto& m = middle[t];
    out.triangles.emplace_back(v[0], m[2], m[1]);
    out.triangles.emplace_back(v[1], m[0], m[2]);
    out.triangles.emplace_back(v[2], m[1], m[0]);
    out.triangles.emplace_back(m[0], m[1], m[2]);
  }
  return out;
}

void smooth_taubin(TriangleMesh& mesh, int rounds) {
  constexpr double kShrink = 0.5,
                   kInflate = -0.51;  // pass band below 1/kShrink + 1/kInflate = 0.04
  const Neighbours around = neighbours_of(mesh);
  std::vector<Vec3> moved(mesh.vertices.size());
  for (int round = 0; round < rounds; ++round)
    for (const double factor : {kShrink, kInflate}) {
      tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t v) {
        const int n = around.first[v + 1] - around.first[v];
        const Vec3& p = mesh.vertices[v];
        moved[v] = n ? Vec3(p + factor * (sum_around(mesh, around, v) / n - p)) : p;
      });
      mesh.vertices.swap(moved);
    }
}

std::vector<Vec3f> smooth_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> sums(mesh.vertices.size(), Vec3::Zero());
  for (const Vec3i& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
    if (!(ab > 0.0 && bc > 0.0 && ca > 0.0)) continue;
    const Vec3 cross = (b - a).cross(c - a);  // 2 area n = sin(angle) |side| |side| n
    sums[t[0]] += cross / (ab * ca);
    sums[t[1]] += cross / (bc * ab);
    sums[t[2]] += cross / (ca * bc);
  }
  std::vector<Vec3f> normals(sums.size());
  std::transform(sums.begin(), sums.end(), normals.begin(),
                 [](const Vec3& n) -> Vec3f { return n.stableNormalized().cast<float>(); });
  return normals;
}

}  // namespace rugae
