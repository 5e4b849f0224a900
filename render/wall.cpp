#include "render/wall.h"

#include "scenes/subdivide.h"

namespace rugae {
namespace {

TriangleMesh mesh_at(const TriangleMesh& rest, const std::vector<Vec3>& vertices) {
  TriangleMesh mesh;
  mesh.vertices = vertices;
  mesh.triangles = rest.triangles;
  mesh.normals = smooth_normals(mesh);
  return mesh;
}

}  // namespace

Wall::Wall(Surface surface, const std::string& device)
    : vertices_{&surface.wall().vertices},
      surface_(std::move(surface)),
      raycaster_(surface_.wall(), device) {}

Wall::Wall(const Wall& rest, Positions now, Positions before, Positions after)
    : moved_(mesh_at(rest.surface_.wall(), *now)),
      now_(std::move(now)),
      before_(std::move(before)),
      after_(std::move(after)),
      vertices_{now_.get(), before_.get(), after_.get()},
      surface_(rest.surface_, moved_),
      raycaster_(rest.raycaster_, vertices_) {}

Vec3 Wall::geometric_normal(int triangle, double beat) const {
  if (!moves() || beat == 0.0) return surface_.geometric_normal(triangle).cast<double>();
  const Vec3i& t = surface_.wall().triangles[triangle];
  const Vec3 a = vertices_(t[0], beat), b = vertices_(t[1], beat), c = vertices_(t[2], beat);
  const Vec3 n = (b - a).cross(c - a);
  const double norm = n.norm();
  return norm > 0.0 ? Vec3(n / norm) : Vec3(Vec3::Zero());
}

Vec3 Wall::point(const Hit& hit, double beat) const {
  const Vec3i& t = surface_.wall().triangles[hit.triangle];
  const double b1 = hit.b1, b2 = hit.b2;
  return (1.0 - b1 - b2) * vertices_(t[0], beat) + b1 * vertices_(t[1], beat) +
         b2 * vertices_(t[2], beat);
}

}  // namespace rugae
