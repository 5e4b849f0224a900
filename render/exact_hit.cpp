#include "render/exact_hit.h"

#include <algorithm>
#include <cmath>

namespace rugae {
namespace {

// Nearer than this to an edge (in barycentric coordinates) the neighbours are asked as well. Single
// precision places a hit to about 1e-6 of the distance to the camera (0.1 um at 100 mm), and
// triangles are wider than 0.1 mm, so rounding moves it by about 1e-3 of a triangle.
constexpr double kNearEdge = 4e-3;
// Two hits nearer to each other than this share of the range are one place on a shared edge.
constexpr double kSamePlace = 1e-12;

}  // namespace

ExactHit::ExactHit(const TriangleMesh& mesh)
    : triangles_(&mesh.triangles), vertices_{&mesh.vertices} {
  auto around = std::make_shared<Around>();
  std::vector<int>& first = around->first_of_vertex;
  first.assign(mesh.vertices.size() + 1, 0);
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++first[t[k] + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) first[v + 1] += first[v];
  around->triangles_of_vertex.resize(3 * mesh.triangles.size());
  std::vector<int> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k)
      around->triangles_of_vertex[next[mesh.triangles[i][k]]++] = static_cast<int>(i);
  around_ = std::move(around);
}

ExactHit::ExactHit(const ExactHit& other, const VertexMotion& vertices)
    : triangles_(other.triangles_), vertices_(vertices), around_(other.around_) {}

// Corners are sheared into a frame in which the ray is the third axis, and the edge functions are
// taken of the other two coordinates. A corner's coordinates do not depend on the triangle, and an
// edge's function changes its sign exactly, and nothing else, for the triangle on its other side:
// no ray slips between neighbours (Woop et al., Watertight ray/triangle intersection, JCGT 2(1),
// 2013).
struct ExactHit::Ray {
  Vec3 origin;
  double beat;
  int x, y, z;  // axes; z is the one along which the ray runs fastest
  double shear_x, shear_y, along;

  Ray(const Vec3& o, const Vec3& direction, double when) : origin(o), beat(when) {
    direction.cwiseAbs().maxCoeff(&z);
    x = z == 2 ? 0 : z + 1;
    y = x == 2 ? 0 : x + 1;
    along = 1.0 / direction[z];
    shear_x = direction[x] * along;
    shear_y = direction[y] * along;
  }
  Vec3 operator()(const Vec3& p) const {
    const Vec3 d = p - origin;
    return {d[x] - shear_x * d[z], d[y] - shear_y * d[z], d[z]};
  }
};

ExactHit::Meeting ExactHit::meet(const Ray& ray, int triangle) const {
  const Vec3i& t = (*triangles_)[triangle];
  const Vec3 a = ray(vertices_(t[0], ray.beat)), b = ray(vertices_(t[1], ray.beat)),
             c = ray(vertices_(t[2], ray.beat));
  const double u = c.x() * b.y() - c.y() * b.x(), v = a.x() * c.y() - a.y() * c.x(),
               w = b.x() * a.y() - b.y() * a.x();
  const double inverse = 1.0 / (u + v + w);
  const double b0 = u * inverse, b1 = v * inverse, b2 = w * inverse;
  return {(b0 * a.z() + b1 * b.z() + b2 * c.z()) * ray.along, b0, b1, b2};
}

Hit ExactHit::operator()(const Vec3& origin, const Vec3& direction, double beat, int proposed,
                         bool strictly) const {
  const Ray ray(origin, direction, beat);
  const Meeting first = meet(ray, proposed);
  const auto as_hit = [](int triangle, const Meeting& m) {
    return Hit{triangle, m.range_mm, static_cast<float>(m.b1), static_cast<float>(m.b2)};
  };
  if (std::min({first.b0, first.b1, first.b2}) > kNearEdge) return as_hit(proposed, first);

  int best = -1;
  Meeting best_meeting = first;
  for (int k = 0; k < 3; ++k) {
    const int vertex = (*triangles_)[proposed][k];
    for (int i = around_->first_of_vertex[vertex]; i < around_->first_of_vertex[vertex + 1]; ++i) {
      const int triangle = around_->triangles_of_vertex[i];
      const Meeting m = meet(ray, triangle);
      // Written so that the not-a-number of a triangle seen edge-on is no hit.
      if (!(m.b0 >= 0.0 && m.b1 >= 0.0 && m.b2 >= 0.0 && m.range_mm > 0.0)) continue;
      const double slack = kSamePlace * m.range_mm;
      const bool nearer = best < 0 || m.range_mm < best_meeting.range_mm - slack;
      const bool tie = best >= 0 && std::abs(m.range_mm - best_meeting.range_mm) <= slack;
      if (nearer || (tie && triangle < best)) {
        best = triangle;
        best_meeting = m;
      }
    }
  }
  if (best >= 0) return as_hit(best, best_meeting);
  return strictly ? Hit{} : nearest_on(ray, proposed, first);
}

// The exact ray passes the outline of the wall within the traversal's rounding: the point of the
// proposed triangle next to it.
Hit ExactHit::nearest_on(const Ray& ray, int triangle, const Meeting& meeting) const {
  Vec3 b(meeting.b0, meeting.b1, meeting.b2);
  b = b.allFinite() ? Vec3(b.cwiseMax(0.0)) : Vec3(1.0, 0.0, 0.0);  // seen edge-on: a corner
  b /= b.sum();
  const Vec3i& t = (*triangles_)[triangle];
  double along = 0.0;
  for (int k = 0; k < 3; ++k) along += b[k] * ray(vertices_(t[k], ray.beat)).z();
  return {triangle, along * ray.along, static_cast<float>(b[1]), static_cast<float>(b[2])};
}

}  // namespace rugae
