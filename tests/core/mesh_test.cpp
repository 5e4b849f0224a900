#include "core/mesh.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/files.h"
#include "core/mesh_io.h"
#include "core/random.h"
#include "core/units.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
constexpr double kRounding = 1e-12;

// An octahedron subdivided onto a sphere; outward winding.
TriangleMesh sphere(double radius_mm, int levels) {
  TriangleMesh m;
  m.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                 {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto split = [&](int a, int b) {
      const auto [it, fresh] =
          middle.emplace(std::minmax(a, b), static_cast<int>(m.vertices.size()));
      if (fresh) m.vertices.push_back((m.vertices[a] + m.vertices[b]).normalized());
      return it->second;
    };
    std::vector<Vec3i> finer;
    for (const Vec3i& t : m.triangles) {
      const int ab = split(t[0], t[1]), bc = split(t[1], t[2]), ca = split(t[2], t[0]);
      for (const Vec3i& f :
           {Vec3i(t[0], ab, ca), Vec3i(ab, t[1], bc), Vec3i(ca, bc, t[2]), Vec3i(ab, bc, ca)})
        finer.push_back(f);
    }
    m.triangles = finer;
  }
  for (Vec3& v : m.vertices) v *= radius_mm;
  return m;
}

class MeshFiles : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  fs::path folder_ = fs::temp_directory_path() /
                     ("rugae_mesh_" +
                      std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST(Mesh, SphereVolumeAreaAndEdges) {
  const TriangleMesh m = sphere(10.0, 5);
  const double tessellation =
      2e-3;  // chords lie inside: second order in the edge length of about 0.05 radii
  EXPECT_NEAR(signed_volume_mm3(m) / (4.0 / 3.0 * kPi * 1000.0), 1.0, tessellation);
  EXPECT_NEAR(area_mm2(m) / (4.0 * kPi * 100.0), 1.0, tessellation);
  const EdgeReport edges = inspect_edges(m);
  EXPECT_TRUE(edges.closed());
  EXPECT_EQ(edges.flipped, 0u);
}

TEST(Mesh, EdgeReportSeesAHoleAndAFlip) {
  TriangleMesh m = sphere(1.0, 1);
  std::swap(m.triangles[3][0], m.triangles[3][1]);
  EXPECT_EQ(inspect_edges(m).flipped, 3u);
  m.triangles.pop_back();
  EXPECT_EQ(inspect_edges(m).open, 3u);
}

TEST(Mesh, ComponentsLargestFirst) {
  TriangleMesh m = sphere(1.0, 1);
  const TriangleMesh small = sphere(1.0, 0);
  const int base = static_cast<int>(m.vertices.size());
  m.vertices.insert(m.vertices.end(), small.vertices.begin(), small.vertices.end());
  for (const Vec3i& t : small.triangles) m.triangles.push_back(t + Vec3i::Constant(base));
  const auto parts = connected_components(m);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].size(), 32u);
  EXPECT_EQ(parts[1].size(), 8u);
}

// The angle-weighted normal of a tessellated sphere tends to the radius with the square of the edge
// length.
TEST(Mesh, NormalsOfASphereConverge) {
  const auto worst_tilt = [](int levels) {
    const TriangleMesh m = sphere(3.0, levels);
    const auto normals = angle_weighted_normals(m);
    double worst = 0.0;
    for (std::size_t v = 0; v < normals.size(); ++v)
      worst = std::max(worst, (normals[v].cast<double>() - m.vertices[v].normalized()).norm());
    return worst;
  };
  const double coarse = worst_tilt(3), fine = worst_tilt(4);
  EXPECT_TRUE(fine > 0.0 && fine < 0.02);
  EXPECT_NEAR(coarse / fine, 2.0, 0.3);
}

TEST(ClosestPoint, AgreesWithTryingEveryTriangle) {
  const TriangleMesh m = sphere(10.0, 3);
  const ClosestPoint closest(m);
  for (int i = 0; i < 200; ++i) {
    const auto n = random_normal(3, Purpose::test, 1, i);
    const Vec3 p = 9.0 * Vec3(n[0], n[1], n[2]);
    double best = 1e300;
    for (const Vec3i& t : m.triangles)
      best = std::min(
          best,
          (closest_on_triangle(p, m.vertices[t[0]], m.vertices[t[1]], m.vertices[t[2]]).point - p)
              .norm());
    const SurfacePoint found = closest(p);
    EXPECT_NEAR(found.distance_mm, best, kRounding * 10.0);
    const Vec3i& t = m.triangles[found.triangle];
    const Vec3 by_barycentric = found.barycentric[0] * m.vertices[t[0]] +
                                found.barycentric[1] * m.vertices[t[1]] +
                                found.barycentric[2] * m.vertices[t[2]];
    EXPECT_TRUE((by_barycentric - found.point).norm() <= kRounding * 100.0);
  }
}

TEST(ClosestPoint, SignIsRightNextToFacesEdgesAndCorners) {
  const TriangleMesh m = sphere(10.0, 2);
  const ClosestPoint closest(m);
  for (int i = 0; i < 2000; ++i) {
    const auto n = random_normal(4, Purpose::test, 2, i);
    const Vec3 direction = Vec3(n[0], n[1], n[2]).normalized();
    EXPECT_TRUE(closest.signed_distance_mm(10.5 * direction) > 0.0);
    EXPECT_TRUE(closest.signed_distance_mm(9.0 * direction) < 0.0);
  }
  for (const Vec3& v : m.vertices) {
    EXPECT_TRUE(closest.signed_distance_mm(1.01 * v) > 0.0);
    EXPECT_TRUE(closest.signed_distance_mm(0.99 * v) < 0.0);
  }
}

TEST_F(MeshFiles, PlyKeepsDoublesNormalsAndColours) {
  TriangleMesh m = sphere(12.345, 2);
  m.normals = angle_weighted_normals(m);
  m.colors.assign(m.vertices.size(), Vec3f(1.0f, 0.5f, 0.0f));
  m.sigma.assign(m.vertices.size(), 0.25f);  // other readers pass over what they do not know
  write_ply(folder_ / "a.ply", m, false);
  const TriangleMesh back = read_mesh(folder_ / "a.ply");
  ASSERT_EQ(back.vertices.size(), m.vertices.size());
  ASSERT_EQ(back.triangles.size(), m.triangles.size());
  EXPECT_NEAR(signed_volume_mm3(back), signed_volume_mm3(m), 1e-6 * signed_volume_mm3(m));  // float
  ASSERT_EQ(back.colors.size(), back.vertices.size());
  EXPECT_NEAR(back.colors[0].y(), 0.5f, 0.51f / 255.0f);  // half a step of 8 bits
}

TEST_F(MeshFiles, GlbIsInMetresAndReadsBack) {
  TriangleMesh m = sphere(100.0, 2);
  m.sigma.assign(m.vertices.size(), 0.25f);
  write_glb(folder_ / "a.glb", m);
  const std::string bytes = read_text(folder_ / "a.glb");
  EXPECT_NE(bytes.find("\"_SIGMA\""), std::string::npos);
  const std::vector<float> metres(m.vertices.size(), 0.25e-3f);
  EXPECT_NE(bytes.find({reinterpret_cast<const char*>(metres.data()), 4 * metres.size()}),
            std::string::npos);
  const TriangleMesh back = read_mesh(folder_ / "a.glb", 1000.0);
  ASSERT_EQ(back.triangles.size(), m.triangles.size());
  EXPECT_NEAR(signed_volume_mm3(back) / signed_volume_mm3(m), 1.0, 1e-5);  // float positions
}

TEST_F(MeshFiles, ScaleIsApplied) {
  const TriangleMesh m = sphere(2.0, 1);
  write_ply(folder_ / "cm.ply", m);
  EXPECT_NEAR(bounding_box(read_mesh(folder_ / "cm.ply", 10.0)).sizes().x(), 40.0, 1e-5);
}

TEST_F(MeshFiles, MissingFile) {
  EXPECT_EQ(message_of([&] { read_mesh("/nowhere/a.ply"); }), "/nowhere/a.ply: no such mesh file");
}

TEST_F(MeshFiles, WithoutTriangles) {
  const auto file =
      write("points.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
            "float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n");
  EXPECT_EQ(message_of([&] { read_mesh(file); }), file.string() + ": no triangles");
}

TEST_F(MeshFiles, VertexThatIsNotFinite) {
  const auto file =
      write("nan.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
            "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n"
            "1 nan 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(message_of([&] { read_mesh(file); }),
            file.string() + ": vertex 1 is not finite (1, nan, 0)");
}

TEST_F(MeshFiles, NotAMesh) {
  const auto file = write("text.ply", "hello\n");
  EXPECT_TRUE(message_of([&] {
                read_mesh(file);
              }).starts_with(file.string() + ": not a mesh that can be read: "));
}

TEST_F(MeshFiles, IndexOutOfRange) {
  TriangleMesh m = sphere(1.0, 0);
  m.triangles[2][1] = 77;
  EXPECT_EQ(message_of([&] { check_mesh(m, "m"); }),
            "m: triangle 2 uses vertex 77, expected 0 to 5");
}

}  // namespace
}  // namespace rugae
