#include "render/exact_hit.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace rugae {
namespace {

// Nearer than this to an edge (in barycentric coordinates) the neighbours are asked as well. Single
// precision places a hit to about 1e-6 of the distance to the camera (0.1 um at 100 mm), and
// triangles are wider than 0.1 mm, so rounding moves it by about 1e-3 of a triangle.
constexpr double kNearEdge = 4e-3;
// Triangles to look at within the slack of a grazing ray.
constexpr std::size_t kMostWithinSlack = 1024;

// Squared distance of the origin from the line between a and b.
double squared_distance(const Vec2& a, const Vec2& b) {
  const Vec2 along = b - a;
  const double length2 = along.squaredNorm();
  const double share = length2 > 0.0 ? std::clamp(-a.dot(along) / length2, 0.0, 1.0) : 0.0;
  return (a + share * along).squaredNorm();
}

bool comes_before(double range_mm, int triangle, const Hit& other) {
  return !other.met() || range_mm < other.range_mm ||
         (range_mm == other.range_mm && triangle < other.triangle);
}

}  // namespace

ExactHit::ExactHit(const TriangleMesh& mesh, double slack_mm)
    : triangles_(&mesh.triangles), vertices_{&mesh.vertices}, slack_mm_(slack_mm) {
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
    : triangles_(other.triangles_),
      vertices_(vertices),
      slack_mm_(other.slack_mm_),
      around_(other.around_) {}

// Corners are sheared into a frame in which the ray is the third axis, and the edge functions are
// taken of the other two coordinates. A corner's coordinates do not depend on the triangle, and an
// edge's function changes its sign exactly, and nothing else, for the triangle on its other side:
// no ray slips between neighbours (Woop et al., Watertight ray/triangle intersection, JCGT 2(1),
// 2013).
struct ExactHit::Ray {
  Vec3 origin;
  double beat;
  int z;  // the axis along which the ray runs fastest
  double shear_x, shear_y, along;

  Ray(const Vec3& o, const Vec3& direction, double when) : origin(o), beat(when) {
    direction.cwiseAbs().maxCoeff(&z);
    const int x = (z + 1) % 3, y = (z + 2) % 3;
    along = 1.0 / direction[z];
    shear_x = direction[x] * along;
    shear_y = direction[y] * along;
  }
  template <int kZ>
  Vec3 sheared(const Vec3& p) const {
    const Vec3 d = p - origin;
    return {d[(kZ + 1) % 3] - shear_x * d[kZ], d[(kZ + 2) % 3] - shear_y * d[kZ], d[kZ]};
  }
  Vec3 operator()(const Vec3& p) const {
    return z == 0 ? sheared<0>(p) : z == 1 ? sheared<1>(p) : sheared<2>(p);
  }
};

// Where the ray meets the plane of a triangle.
struct ExactHit::Meeting {
  double range_mm;
  double b0, b1, b2;

  // Written so that the not-a-number of a triangle seen edge-on is no hit.
  bool inside() const { return b0 >= 0.0 && b1 >= 0.0 && b2 >= 0.0 && range_mm > 0.0; }
  Hit as_hit(int triangle) const {
    return {triangle, range_mm, static_cast<float>(b1), static_cast<float>(b2)};
  }
};

ExactHit::Meeting ExactHit::meet(const Ray& ray, int triangle) const {
  // The axis is a constant in each of the three: coordinates stay in registers.
  return ray.z == 0   ? meet_along<0>(ray, triangle)
         : ray.z == 1 ? meet_along<1>(ray, triangle)
                      : meet_along<2>(ray, triangle);
}

template <int kZ>
ExactHit::Meeting ExactHit::meet_along(const Ray& ray, int triangle) const {
  const Vec3i& t = (*triangles_)[triangle];
  const Vec3 a = ray.sheared<kZ>(vertices_(t[0], ray.beat)),
             b = ray.sheared<kZ>(vertices_(t[1], ray.beat)),
             c = ray.sheared<kZ>(vertices_(t[2], ray.beat));
  const double u = c.x() * b.y() - c.y() * b.x(), v = a.x() * c.y() - a.y() * c.x(),
               w = b.x() * a.y() - b.y() * a.x();
  const double inverse = 1.0 / (u + v + w);
  const double b0 = u * inverse, b1 = v * inverse, b2 = w * inverse;
  return {(b0 * a.z() + b1 * b.z() + b2 * c.z()) * ray.along, b0, b1, b2};
}

// The ray passes the triangle, or its edges within `distance_mm`, in the ray's frame.
bool ExactHit::passes_near(const Ray& ray, int triangle, double distance_mm) const {
  Vec2 corners[3];
  for (int k = 0; k < 3; ++k)
    corners[k] = ray(vertices_((*triangles_)[triangle][k], ray.beat)).head<2>();
  for (int k = 0; k < 3; ++k)
    if (squared_distance(corners[k], corners[(k + 1) % 3]) <= distance_mm * distance_mm)
      return true;
  return false;
}

Hit ExactHit::operator()(const Vec3& origin, const Vec3& direction, double beat,
                         int proposed) const {
  const Ray ray(origin, direction, beat);
  const Meeting first = meet(ray, proposed);
  if (std::min({first.b0, first.b1, first.b2}) > kNearEdge) return first.as_hit(proposed);
  // Whichever edge is near, the triangle on its other side has the nearest corner too.
  const int corner =
      first.b0 >= first.b1 && first.b0 >= first.b2 ? 0 : (first.b1 >= first.b2 ? 1 : 2);
  const Hit hit = nearest_around(ray, (*triangles_)[proposed][corner]);
  return hit.met() ? hit : nearest_within_slack(ray, proposed);
}

template <typename Visit>
void ExactHit::for_each_around(int vertex, const Visit& visit) const {
  for (int i = around_->first_of_vertex[vertex]; i < around_->first_of_vertex[vertex + 1]; ++i)
    visit(around_->triangles_of_vertex[i]);
}

Hit ExactHit::nearest_around(const Ray& ray, int vertex) const {
  Hit nearest;
  for_each_around(vertex, [&](int t) {
    const Meeting m = meet(ray, t);
    if (m.inside() && comes_before(m.range_mm, t, nearest)) nearest = m.as_hit(t);
  });
  return nearest;
}

// A ray that grazes the wall may run beside it within the slack over many triangles before it meets
// one. All that hang together with the proposed one are looked at; the ray passes an outline where
// it meets none.
Hit ExactHit::nearest_within_slack(const Ray& ray, int triangle) const {
  constexpr double kSheared = 3.0;  // the ray's frame stretches distances by less
  Hit nearest;
  std::vector<int> seen{triangle};
  const auto look_at = [&](int t) {
    if (std::ranges::find(seen, t) != seen.end()) return;
    const Meeting m = meet(ray, t);
    if (m.inside() && comes_before(m.range_mm, t, nearest)) nearest = m.as_hit(t);
    if (m.inside() || passes_near(ray, t, kSheared * slack_mm_)) seen.push_back(t);
  };
  for (std::size_t at = 0; at < seen.size() && seen.size() < kMostWithinSlack; ++at)
    for (int k = 0; k < 3; ++k) for_each_around((*triangles_)[seen[at]][k], look_at);
  return nearest;
}

}  // namespace rugae
