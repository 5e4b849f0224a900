// The bounding-volume hierarchy is Eigen's KdBVH; ours are the descent into it, the triangles and
// the sign.

#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <unsupported/Eigen/BVH>
#include <utility>

#include "core/check.h"
#include "core/mesh.h"

namespace rugae {
namespace {

struct IndexedTriangle {
  Vec3 a, b, c;
  int index;
};

// Found by Eigen's hierarchy through argument-dependent look-up.
Eigen::AlignedBox3d bounding_box(const IndexedTriangle& t) {
  return Eigen::AlignedBox3d(t.a).extend(t.b).extend(t.c);
}

using Hierarchy = Eigen::KdBVH<double, 3, IndexedTriangle>;

// The nearest triangle so far.
struct Nearest {
  double squared_mm2 = std::numeric_limits<double>::infinity();
  SurfacePoint found{};

  void look_at(const IndexedTriangle& t, const Vec3& p) {
    const TrianglePoint q = closest_on_triangle(p, t.a, t.b, t.c);
    const double d = (q.point - p).squaredNorm();
    // Ties, as at shared edges, go to the lowest index, so that the answer does not depend on the
    // tree.
    if (d < squared_mm2 || (d == squared_mm2 && t.index < found.triangle)) {
      squared_mm2 = d;
      found = {q.point, 0.0, t.index, q.barycentric};
    }
  }
};

// Depth first, into the nearer of two boxes first: most of the tree is then out of reach. (Eigen's
// own search keeps a heap on the free store, and opens what lies beyond the nearest triangle.)
Nearest nearest(const Hierarchy& tree, const Vec3& p) {
  struct Box {
    int node;
    double squared_mm2;  // from p
  };
  // At most one waits at each level, and the tree halves its triangles from level to level.
  constexpr int kMostWaiting = 64;
  std::array<Box, kMostWaiting> waiting;
  int count = 0;
  Nearest best;
  waiting[count++] = {tree.getRootIndex(), 0.0};
  while (count > 0) {
    const Box box = waiting[--count];
    if (box.squared_mm2 > best.squared_mm2) continue;
    Hierarchy::VolumeIterator volume{}, volumes_end{};
    Hierarchy::ObjectIterator object{}, objects_end{};
    tree.getChildren(box.node, volume, volumes_end, object, objects_end);
    for (; object != objects_end; ++object) best.look_at(*object, p);
    const int first = count;
    for (; volume != volumes_end; ++volume)
      waiting[count++] = {*volume, tree.getVolume(*volume).squaredExteriorDistance(p)};
    if (count == first + 2 && waiting[first].squared_mm2 < waiting[first + 1].squared_mm2)
      std::swap(waiting[first], waiting[first + 1]);
  }
  return best;
}

}  // namespace

struct ClosestPoint::Tree {
  const TriangleMesh& mesh;
  Hierarchy hierarchy;
  // For signs alone, made when the first is asked for:
  std::once_flag with_signs;
  std::vector<Vec3f> vertex_normals;
  std::vector<Vec3i>
      across;  // of each triangle, the neighbour beyond its edge k (from corner k to k + 1), or -1

  explicit Tree(const TriangleMesh& m) : mesh(m) {
    std::vector<IndexedTriangle> triangles;
    triangles.reserve(m.triangles.size());
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
      const Vec3i& i = m.triangles[t];
      triangles.push_back(
          {m.vertices[i[0]], m.vertices[i[1]], m.vertices[i[2]], static_cast<int>(t)});
    }
    hierarchy.init(triangles.begin(), triangles.end());
  }

  // Pseudonormal of the feature (face, edge or corner) that the closest point lies on.
  Vec3 feature_normal(const SurfacePoint& s) {
    std::call_once(with_signs, [&] {
      vertex_normals = angle_weighted_normals(mesh);
      across = edge_neighbours(mesh);
    });
    constexpr double kOnFeature = 1e-9;  // barycentric; the closest point sets exact zeros
    int zeros = 0, zero = 0, one = 0;
    for (int k = 0; k < 3; ++k) {
      if (s.barycentric[k] <= kOnFeature) {
        ++zeros;
        zero = k;
      } else {
        one = k;
      }
    }
    if (zeros == 2) return vertex_normals[mesh.triangles[s.triangle][one]].cast<double>();
    const Vec3 face = triangle_normal(mesh, s.triangle);
    if (zeros == 0) return face;
    const int beyond = across[s.triangle][(zero + 1) % 3];
    return beyond < 0 ? face : Vec3(face + triangle_normal(mesh, beyond));
  }
};

ClosestPoint::ClosestPoint(const TriangleMesh& mesh) {
  check_mesh(mesh, "closest point");
  tree_ = std::make_unique<Tree>(mesh);
}
ClosestPoint::~ClosestPoint() = default;
ClosestPoint::ClosestPoint(ClosestPoint&&) noexcept = default;

SurfacePoint ClosestPoint::operator()(const Vec3& p) const {
  check(p.allFinite(), "closest point: the query ({}, {}, {}) is not finite", p.x(), p.y(), p.z());
  Nearest best = nearest(tree_->hierarchy, p);
  best.found.distance_mm = std::sqrt(best.squared_mm2);
  return best.found;
}

double ClosestPoint::signed_distance_mm(const Vec3& p) const {
  const SurfacePoint s = (*this)(p);
  return tree_->feature_normal(s).dot(p - s.point) < 0.0 ? -s.distance_mm : s.distance_mm;
}

}  // namespace rugae
