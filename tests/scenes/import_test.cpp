// Scenes from mesh files, and what is said of broken ones.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "core/presets.h"
#include "core/yaml.h"
#include "scenes/scene.h"
#include "scenes/scene_file.h"
#include "tests/scenes/scene_files.h"

namespace rugae {
namespace {

TEST_F(SceneFiles, AnImportedWallMovesAlongItsOwnLongAxis) {
  write("tube.ply", tube(20.0, 200.0));
  const Scene scene = load(write("tube.yaml", std::string("kind: mesh\nmesh: tube.ply\n"
                                                          "with_relief: false\n"
                                                          "deformation: {peristalsis: true}\n")));
  ASSERT_TRUE(scene.motion);
  TriangleMesh wall = scene.wall;
  scene.motion(40.0, wall.vertices);
  double least_mm = 1e9;
  for (std::size_t v = 0; v < wall.vertices.size(); ++v)
    if (std::abs(wall.vertices[v].z() - 100.0) < 70.0)
      least_mm = std::min(least_mm, wall.vertices[v].head<2>().norm());
  EXPECT_NEAR(least_mm, 20.0 - 7.0, 1.0);  // the axis found is off the tube's by less
  EXPECT_EQ(self_intersections(wall), 0);
}

TEST_F(SceneFiles, AMeshLiesBesideTheFileThatNamesIt) {
  fs::create_directories(path("base"));
  write("base/ico.ply", icosahedron(60.0));
  write("base/base.yaml", std::string("kind: mesh\nmesh: ico.ply\nwall_normals: outward\n"
                                      "with_relief: false\nopen_ends: refuse\n"));
  const auto mine = write("mine.yaml", std::string("like: base/base.yaml\ntarget_edge_mm: 4\n"));
  const SceneFile read = read_scene_file(mine, 1);
  EXPECT_EQ(read.kind, SceneKind::mesh);
  EXPECT_EQ(read.import.wall, WallNormals::outward);
  EXPECT_EQ(read.import.open_ends, OpenEnds::refuse);
  EXPECT_FALSE(read.import.with_relief);
  EXPECT_EQ(read.import.target_edge_mm, 4.0);
  expect_whole(load(mine));
  EXPECT_EQ(error_of(write("polyps.yaml", std::string("like: base/base.yaml\nlesions: {polyp: "
                                                      "1}\n"))),
            path("polyps.yaml") + ":2:10: lesions need a stomach of kind procedural");
}

TEST_F(SceneFiles, ACoarseMeshIsRoundedAndRefined) {
  const auto mesh = write("ico.ply", icosahedron(60.0));
  const auto file = write("ico.yaml", std::string("kind: mesh\nmesh: ico.ply\ntarget_edge_mm: 1.5\n"
                                                  "with_relief: false\n"));
  const Scene medium = load(file, "medium"), coarse = load(file);
  expect_whole(medium);
  EXPECT_LE(longest_edge_mm(medium.wall), 2.5 * 1.5);
  EXPECT_NEAR(static_cast<double>(medium.wall.triangles.size()) / coarse.wall.triangles.size(), 4.0,
              1e-9);
  // smoothing keeps the volume and rounds the edges off
  const double volume = signed_volume_mm3(icosahedron(60.0));
  EXPECT_NEAR(signed_volume_mm3(medium.wall) / volume, 1.0, 0.02);
  EXPECT_LT(bounding_box(medium.wall).sizes().x(), bounding_box(icosahedron(60.0)).sizes().x());
  for (const Region region : medium.regions) ASSERT_EQ(region, Region::unknown);
}

TEST_F(SceneFiles, ABareMeshGetsRelief) {
  const auto mesh = write("ico.ply", icosahedron(60.0));
  const auto file = write("flat.yaml", std::string("kind: mesh\nmesh: ico.ply\nwith_relief: "
                                                   "false\n"));
  const Scene wall = load(mesh), flat = load(file);
  expect_whole(wall);
  ASSERT_EQ(wall.wall.vertices.size(), flat.wall.vertices.size());
  double highest = 0.0;
  for (std::size_t v = 0; v < wall.wall.vertices.size(); ++v)
    highest = std::max(highest, (wall.wall.vertices[v] - flat.wall.vertices[v]).norm());
  EXPECT_GE(highest, 2.0);
  EXPECT_LE(highest, 4.5);
  EXPECT_LT(signed_volume_mm3(wall.wall), signed_volume_mm3(flat.wall));  // folds point inward
}

TEST_F(SceneFiles, TheWallsSideIsFoundOrAskedFor) {
  write("in.ply", inside_out(icosahedron(60.0)));
  write("out.ply", icosahedron(60.0));
  const auto scene = [&](const std::string& name, const std::string& normals) {
    return write(name + "_" + normals + ".yaml", "kind: mesh\nmesh: " + name +
                                                     ".ply\ntarget_edge_mm: 3\nwith_relief: "
                                                     "false\nwall_normals: " +
                                                     normals + "\n");
  };
  const Scene turned = load(scene("in", "auto"));
  expect_whole(turned);
  ASSERT_EQ(turned.notes.size(), 1u);
  EXPECT_EQ(turned.notes[0], "its normals point into the cavity; turned");
  EXPECT_TRUE(load(scene("out", "auto")).notes.empty());
  expect_whole(load(scene("in", "inward")));
  expect_whole(load(scene("out", "outward")));
  EXPECT_EQ(error_of(scene("in", "outward")),
            path("in.ply") +
                ": the wall encloses -547.8 ml with normals outward; the other way is "
                "meant?");
}

TEST_F(SceneFiles, OpenEndsAreCappedOrRefused) {
  write("tube.ply", tube(25.0, 120.0));
  const auto capped = write(
      "capped.yaml", std::string("kind: mesh\nmesh: tube.ply\ntarget_edge_mm: 2\nwith_relief: "
                                 "false\n"));
  const Scene scene = load(capped);
  expect_whole(scene);
  EXPECT_NEAR(signed_volume_mm3(scene.wall), M_PI * 25.0 * 25.0 * 120.0, 0.03 * 235e3);
  ASSERT_EQ(scene.notes.size(), 2u);
  EXPECT_EQ(scene.notes[0], "open end of girth 157.0 mm at (0, 0, 0) capped");
  EXPECT_EQ(scene.notes[1], "open end of girth 157.0 mm at (0, 0, 120) capped");
  const auto refused = write("refused.yaml", std::string("kind: mesh\nmesh: tube.ply\nopen_ends: "
                                                         "refuse\n"));
  EXPECT_EQ(error_of(refused),
            path("tube.ply") + ": the wall has 96 open edges; set open_ends: cap to close them");
}

TEST_F(SceneFiles, OnePieceOfSeveralIsTaken) {
  TriangleMesh both = icosahedron(60.0);
  const TriangleMesh other = tube(25.0, 120.0);
  const int base = static_cast<int>(both.vertices.size());
  for (const Vec3& v : other.vertices) both.vertices.push_back(v + Vec3(200, 0, 0));
  for (const Vec3i& t : other.triangles) both.triangles.push_back(t + Vec3i::Constant(base));
  write("both.ply", both);
  const auto scene = [&](int component) {
    return write(std::to_string(component) + ".yaml",
                 "kind: mesh\nmesh: both.ply\ntarget_edge_mm: 3\nwith_relief: false\ncomponent: " +
                     std::to_string(component) + "\n");
  };
  EXPECT_GT(bounding_box(load(scene(0)).wall).min().x(), 100.0);
  const Scene ico = load(scene(1));
  EXPECT_LT(bounding_box(ico.wall).max().x(), 100.0);
  EXPECT_EQ(ico.notes.at(0), "piece 1 of 2 taken, 20 of 2324 triangles");
  EXPECT_EQ(error_of(scene(2)), path("both.ply") + ": component is 2, the mesh has pieces 0 to 1");
}

TEST_F(SceneFiles, TrianglesThatWindAgainstEachOtherAreTurned) {
  TriangleMesh mesh = icosahedron(60.0);
  for (int t : {3, 4, 11}) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const Scene scene = load(write("mixed.ply", mesh));
  expect_whole(scene);
  EXPECT_EQ(scene.notes.at(0), "3 triangles turned to wind as their neighbours");
}

TEST_F(SceneFiles, BrokenMeshesAreToldInOneLine) {
  EXPECT_EQ(error_of(path("none.ply")), path("none.ply") + ": no such mesh file");
  EXPECT_EQ(error_of(write("points.ply",
                           std::string("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                       "property float y\nproperty float z\nelement face 0\n"
                                       "property list uchar int vertex_indices\nend_header\n"
                                       "0 0 0\n1 0 0\n0 1 0\n"))),
            path("points.ply") + ": no triangles");
  EXPECT_EQ(error_of(write("nan.ply",
                           std::string("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                       "property float y\nproperty float z\nelement face 1\n"
                                       "property list uchar int vertex_indices\nend_header\n"
                                       "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"))),
            path("nan.ply") + ": vertex 1 is not finite (1, nan, 0)");
}

TEST_F(SceneFiles, AWrongUnitIsNoticedAndTheRightOneSuggested) {
  const double box_mm = bounding_box(icosahedron(60.0)).sizes().maxCoeff();
  ASSERT_NEAR(box_mm, 102.1, 0.05);
  EXPECT_EQ(error_of(write("m.ply", icosahedron(0.06))),
            path("m.ply") +
                ": its longest side is 0.1021 mm, expected 40 to 1000; if it is in "
                "metres, set mm_per_unit: 1000");
  EXPECT_EQ(error_of(write("cm.ply", icosahedron(6.0))).substr(path("cm.ply").size(), 49),
            ": its longest side is 10.21 mm, expected 40 to 10");
  EXPECT_EQ(error_of(write("um.ply", icosahedron(60000.0))),
            path("um.ply") +
                ": its longest side is 1.021e+05 mm, expected 40 to 1000; if it is in "
                "micrometres, set mm_per_unit: 0.001");
  const auto scaled =
      write("m.yaml", std::string("kind: mesh\nmesh: m.ply\nmm_per_unit: 1000\ntarget_edge_mm: 2\n"
                                  "with_relief: false\n"));
  EXPECT_NEAR(signed_volume_mm3(load(scaled).wall) / signed_volume_mm3(icosahedron(60.0)), 1.0,
              0.02);
}

}  // namespace
}  // namespace rugae
