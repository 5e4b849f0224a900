#pragma once
// Scene and mesh files in a folder of their own.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "scenes/scene.h"
#include "self_intersection.h"

namespace rugae {

namespace fs = std::filesystem;

class SceneFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("rugae_scene_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    write_atomic(folder_ / name, text);
    return path(name);
  }
  std::string write(const std::string& name, const TriangleMesh& mesh) const {
    write_ply(folder_ / name, mesh);
    return path(name);
  }
  static Scene load(const std::string& name, const std::string& resolution = "coarse") {
    return load_scene({.name_or_path = name, .seed = 1, .resolution = resolution, .oil = 0.0});
  }
  static std::string error_of(const std::string& name, const std::string& resolution = "coarse") {
    try {
      load(name, resolution);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }

 private:
  fs::path folder_;
};

// An icosahedron, stretched: 20 triangles with edges of about 70 mm.

inline TriangleMesh icosahedron(double radius_mm) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vec3& v : mesh.vertices) v *= radius_mm / std::sqrt(1.0 + g * g);
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  return mesh;
}

// A tube along z, open at both ends.
inline TriangleMesh tube(double radius_mm, double length_mm) {
  constexpr int kAround = 48, kAlong = 24;
  TriangleMesh mesh;
  for (int j = 0; j <= kAlong; ++j)
    for (int i = 0; i < kAround; ++i) {
      const double a = 2.0 * M_PI * i / kAround;
      mesh.vertices.emplace_back(radius_mm * std::cos(a), radius_mm * std::sin(a),
                                 length_mm * j / kAlong);
    }
  for (int j = 0; j < kAlong; ++j)
    for (int i = 0; i < kAround; ++i) {
      const int a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      mesh.triangles.emplace_back(a, b, b + kAround);
      mesh.triangles.emplace_back(a, b + kAround, a + kAround);
    }
  return mesh;
}

inline TriangleMesh inside_out(TriangleMesh mesh) {
  for (Vec3i& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

inline void expect_whole(const Scene& scene) {
  const EdgeReport edges = inspect_edges(scene.wall);
  EXPECT_TRUE(edges.closed());
  EXPECT_EQ(edges.flipped, 0u);
  EXPECT_GT(signed_volume_mm3(scene.wall), 0.0);
  EXPECT_EQ(scene.wall.normals.size(), scene.wall.vertices.size());
  EXPECT_EQ(scene.rest_positions.size(), scene.wall.vertices.size());
  EXPECT_EQ(scene.regions.size(), scene.wall.vertices.size());
}

inline double longest_edge_mm(const TriangleMesh& mesh) {
  double longest = 0.0;
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      longest = std::max(longest, (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
  return longest;
}

}  // namespace rugae
