#pragma once
// Meshes with known answers.

#include <cmath>

#include "core/mesh.h"
#include "core/units.h"

namespace rugae::shapes {

/// A sphere about `centre` with outward normals: rings of latitude, poles as triangle fans.
inline TriangleMesh sphere(double radius_mm, int rings, const Vec3& centre = Vec3::Zero()) {
  TriangleMesh mesh;
  const int around = 2 * rings;
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double polar = kPi * i / rings, azimuth = 2.0 * kPi * j / around;
      mesh.vertices.emplace_back(centre + radius_mm * Vec3(std::sin(polar) * std::cos(azimuth),
                                                           std::sin(polar) * std::sin(azimuth),
                                                           std::cos(polar)));
    }
  const int north = static_cast<int>(mesh.vertices.size()), south = north + 1;
  mesh.vertices.emplace_back(centre + Vec3(0, 0, radius_mm));
  mesh.vertices.emplace_back(centre - Vec3(0, 0, radius_mm));
  const auto at = [&](int i, int j) { return (i - 1) * around + j % around; };
  for (int j = 0; j < around; ++j) {
    mesh.triangles.emplace_back(north, at(1, j), at(1, j + 1));
    for (int i = 1; i + 1 < rings; ++i) {
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
    mesh.triangles.emplace_back(south, at(rings - 1, j + 1), at(rings - 1, j));
  }
  return mesh;
}

/// The rectangle [0, width] x [0, height] at height z, in cells of `step` mm, normals along +z.
inline TriangleMesh plane(double width_mm, double height_mm, double step_mm, double z_mm) {
  TriangleMesh mesh;
  const int nx = static_cast<int>(std::lround(width_mm / step_mm));
  const int ny = static_cast<int>(std::lround(height_mm / step_mm));
  for (int y = 0; y <= ny; ++y)
    for (int x = 0; x <= nx; ++x) mesh.vertices.emplace_back(x * step_mm, y * step_mm, z_mm);
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) {
      const int a = y * (nx + 1) + x;
      mesh.triangles.emplace_back(a, a + 1, a + nx + 2);
      mesh.triangles.emplace_back(a, a + nx + 2, a + nx + 1);
    }
  return mesh;
}

}  // namespace rugae::shapes
