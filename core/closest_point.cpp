// The bounding-volume hierarchy is Eigen's KdBVH; ours are the triangles and the sign.

#include <cmath>
#include <limits>
#include <unsupported/Eigen/BVH>

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

struct NearestQuery {
  using Scalar = double;
  Vec3 p;
  double best = std::numeric_limits<double>::infinity();
  SurfacePoint found{};

  double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
    return box.squaredExteriorDistance(p);
  }
  double minimumOnObject(const IndexedTriangle& t) {
    const TrianglePoint q = closest_on_triangle(p, t.a, t.b, t.c);
    const double d = (q.point - p).squaredNorm();
    // Ties, as at shared edges, go to the lowest index, so that the answer does not depend on the
    // tree.
    if (d < best || (d == best && t.index < found.triangle)) {
      best = d;
      found = {q.point, 0.0, t.index, q.barycentric};
    }
    return d;
  }
};

}  // namespace

struct ClosestPoint::Tree {
  const TriangleMesh& mesh;
  Hierarchy hierarchy;
  std::vector<Vec3f> vertex_normals;
  std::vector<Vec3i>
      across;  // of each triangle, the neighbour beyond its edge k (from corner k to k + 1), or -1

  explicit Tree(const TriangleMesh& m)
      : mesh(m), vertex_normals(angle_weighted_normals(m)), across(edge_neighbours(m)) {
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
  Vec3 feature_normal(const SurfacePoint& s) const {
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
  NearestQuery query{p};
  Eigen::BVMinimize(tree_->hierarchy, query);
  query.found.distance_mm = std::sqrt(query.best);
  return query.found;
}

double ClosestPoint::signed_distance_mm(const Vec3& p) const {
  const SurfacePoint s = (*this)(p);
  return tree_->feature_normal(s).dot(p - s.point) < 0.0 ? -s.distance_mm : s.distance_mm;
}

}  // namespace rugae
