#pragma once
// Walls and cameras with known answers.

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "cameras/camera.h"
#include "core/mesh.h"
#include "core/random.h"
#include "core/rigid3.h"
#include "render/surface.h"

namespace rugae::test {

/// An icosahedron split `levels` times, corners on the sphere of `radius_mm` times
/// scale(direction); vertex normals radial.
inline TriangleMesh sphere_mesh(
    int levels, double radius_mm,
    const std::function<double(const Vec3&)>& scale = [](const Vec3&) { return 1.0; }) {
  TriangleMesh mesh;
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  for (const Vec3& v : {Vec3(-1, g, 0), Vec3(1, g, 0), Vec3(-1, -g, 0), Vec3(1, -g, 0),
                        Vec3(0, -1, g), Vec3(0, 1, g), Vec3(0, -1, -g), Vec3(0, 1, -g),
                        Vec3(g, 0, -1), Vec3(g, 0, 1), Vec3(-g, 0, -1), Vec3(-g, 0, 1)})
    mesh.vertices.push_back(v.normalized());
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), 0);
      if (fresh) {
        at->second = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      }
      return at->second;
    };
    std::vector<Vec3i> finer;
    for (const Vec3i& t : mesh.triangles) {
      const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (Vec3& v : mesh.vertices) {
    mesh.normals.push_back(v.cast<float>());
    v *= radius_mm * scale(v);
  }
  return mesh;
}

/// The square |x|, |y| <= half_mm at height z, split into 2 cells^2 triangles, normal along +z.
inline TriangleMesh plane_mesh(double z_mm, double half_mm, int cells) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      mesh.vertices.emplace_back(half_mm * (2.0 * i / cells - 1.0),
                                 half_mm * (2.0 * j / cells - 1.0), z_mm);
      mesh.normals.emplace_back(0.0f, 0.0f, 1.0f);
    }
  const int row = cells + 1;
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      const int a = j * row + i;
      mesh.triangles.emplace_back(a, a + 1, a + row);
      mesh.triangles.emplace_back(a + 1, a + row + 1, a + row);
    }
  return mesh;
}

inline void append(TriangleMesh& mesh, const TriangleMesh& more) {
  const int base = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), more.vertices.begin(), more.vertices.end());
  mesh.normals.insert(mesh.normals.end(), more.normals.begin(), more.normals.end());
  for (const Vec3i& t : more.triangles) mesh.triangles.push_back(t + Vec3i::Constant(base));
}

/// A cavity with deep folds that hide one another.
inline TriangleMesh folded_mesh(int levels) {
  return sphere_mesh(levels, 30.0, [](const Vec3& d) {
    const double along = std::atan2(d.y(), d.x());
    return 1.0 + 0.4 * std::cos(9.0 * along) * (1.0 - d.z() * d.z()) + 0.1 * std::sin(7.0 * d.z());
  });
}

inline Lens small_lens(int width = 96, int height = 72) {
  Lens lens;
  lens.width = width;
  lens.height = height;
  lens.fx = lens.fy = 0.42 * width;
  lens.cx = 0.5 * width + 0.3;
  lens.cy = 0.5 * height - 0.2;
  lens.k1 = -0.2;
  lens.k2 = 0.03;
  lens.p1 = 2e-4;
  lens.p2 = -1e-4;
  return lens;
}

inline Camera small_camera(int width = 96, int height = 72) {
  Camera camera;
  camera.name = "small";
  camera.lens = small_lens(width, height);
  camera.sensor = {6.0, 30.0, 10, 18000.0, 10.0, Shutter::global};
  return camera;
}

/// The same material everywhere.
inline Material constant_material(const MucosaSample& sample) {
  return [sample](std::span<const MaterialQuery>, std::span<MucosaSample> samples) {
    std::fill(samples.begin(), samples.end(), sample);
  };
}

inline MucosaSample lambert(float albedo) {
  MucosaSample sample;
  sample.albedo = Vec3f::Constant(albedo);
  sample.coverage = 0.0f;
  return sample;
}

/// A random unit vector, and a random rotation.
inline Vec3 random_direction(std::uint32_t draw) {
  const auto n = random_normal(1, Purpose::test, 7, draw);
  return Vec3(n[0], n[1], n[2]).normalized();
}
inline Quat random_rotation(std::uint32_t draw) {
  const auto n = random_normal(1, Purpose::test, 8, draw);
  return Quat(n[0], n[1], n[2], n[3]).normalized();
}

/// The nearest hit by trying every triangle (Moeller and Trumbore 1997), in extended precision.
struct BruteHit {
  int triangle;
  double range_mm;
};
inline std::optional<BruteHit> brute_force(const TriangleMesh& mesh, const Vec3& origin,
                                           const Vec3& direction, double least_mm = 0.0) {
  using Wide = Eigen::Matrix<long double, 3, 1>;
  const Wide o = origin.cast<long double>(), d = direction.cast<long double>();
  std::optional<BruteHit> best;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vec3i& t = mesh.triangles[i];
    const Wide a = mesh.vertices[t[0]].cast<long double>();
    const Wide e1 = mesh.vertices[t[1]].cast<long double>() - a,
               e2 = mesh.vertices[t[2]].cast<long double>() - a;
    const Wide p = d.cross(e2);
    const long double det = e1.dot(p);
    if (det == 0) continue;
    const Wide s = o - a;
    const long double u = s.dot(p) / det;
    const Wide q = s.cross(e1);
    const long double v = d.dot(q) / det, range = e2.dot(q) / det;
    constexpr long double kSlack = 1e-12L;  // rays through corners
    if (u < -kSlack || v < -kSlack || u + v > 1 + kSlack || range <= least_mm) continue;
    if (!best || range < best->range_mm)
      best = BruteHit{static_cast<int>(i), static_cast<double>(range)};
  }
  return best;
}

}  // namespace rugae::test
