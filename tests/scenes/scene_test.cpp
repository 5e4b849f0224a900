// Scenes from presets and YAML files, and what is said of broken ones.

#include "scenes/scene.h"

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
#include "scenes/scene_file.h"
#include "tests/scenes/scene_files.h"
#include "tests/shared_data.h"

namespace rugae {
namespace {

TEST_F(SceneFiles, ThePresetIsAStomach) {
  const Scene scene = load("stomach");
  expect_whole(scene);
  EXPECT_EQ(scene.name, "stomach");
  EXPECT_EQ(scene.rest_positions, scene.wall.vertices);
  EXPECT_EQ(preset_names("scenes"),
            (std::vector<std::string>{"chessboard", "stomach", "stomach-lesions", "stomach-moving",
                                      "stomach-unclean"}));
  EXPECT_EQ(error_of("stomch"),
            "scene 'stomch': no such preset; did you mean 'stomach'?; known: chessboard, stomach, "
            "stomach-lesions, stomach-moving, stomach-unclean");
  EXPECT_EQ(error_of("stomach", "medum"),
            "resolution is 'medum', expected one of: coarse, medium, fine; did you mean 'medium'?");
}

TEST_F(SceneFiles, TheMovingPresetIsTheSameStomachInMotion) {
  const Scene still = load("stomach"), moving = load("stomach-moving");
  EXPECT_FALSE(still.motion);
  EXPECT_EQ(still.motion_reach_mm, 0.0);
  ASSERT_TRUE(moving.motion);
  EXPECT_EQ(moving.wall.vertices, still.wall.vertices);  // at rest
  EXPECT_EQ(moving.rest_positions, still.rest_positions);
  std::vector<Vec3> now;
  double most = 0.0;
  for (const double time_s : {0.0, 3.3, 71.0}) {
    moving.motion(time_s, now);
    ASSERT_EQ(now.size(), moving.rest_positions.size());
    for (std::size_t v = 0; v < now.size(); ++v)
      most = std::max(most, (now[v] - moving.rest_positions[v]).norm());
  }
  EXPECT_TRUE(most >= 7.0 && most <= moving.motion_reach_mm) << most;
  EXPECT_TRUE(moving.motion_reach_mm <= 9.01);  // 7 mm of a wave and half a sway of 4 mm
}

TEST_F(SceneFiles, ADeformationOutOfRangeIsNamedByLineAndColumn) {
  EXPECT_EQ(error_of(write("a.yaml", std::string("deformation: {waves_per_minute: 30}\n"))),
            path("a.yaml") + ":1:33: waves_per_minute is 30, expected 0.5 to 12");
  EXPECT_EQ(error_of(write("b.yaml", std::string("deformation:\n  breathng: true\n"))),
            path("b.yaml") + ":2:3: unknown key 'breathng'; did you mean 'breathing'?");
  EXPECT_EQ(error_of(write("c.yaml", std::string("deformation: {width_mm: 40}\n"))),
            path("c.yaml") +
                ": deformation: width_mm is 40, expected at most 20.0 where waves are 44.0 mm "
                "apart (speed_mm_s 2.2, waves_per_minute 3)");
}

TEST_F(SceneFiles, ResolutionsHaveTheTrianglesTheyPromise) {
  EXPECT_NEAR(static_cast<double>(load("stomach", "coarse").wall.triangles.size()), 50e3, 5e3);
  EXPECT_NEAR(static_cast<double>(load("stomach", "medium").wall.triangles.size()), 250e3, 25e3);
  const Scene fine = load("stomach", "fine");
  EXPECT_NEAR(static_cast<double>(fine.wall.triangles.size()), 1e6, 1e5);
  expect_whole(fine);
}

TEST_F(SceneFiles, YamlReachesTheStomach) {
  const auto file = write("half.yaml", std::string("scale: 0.5\nrelief: {rugae_height_mm: 0}\n"));
  const Scene half = load(file);
  EXPECT_NEAR(signed_volume_mm3(half.wall) / 1000.0, 1500.0 / 8.0, 15.0);
  EXPECT_NEAR(static_cast<double>(half.wall.triangles.size()), 50e3, 5e3);
}

TEST_F(SceneFiles, BrokenYamlIsNamedByLineAndColumn) {
  EXPECT_EQ(error_of(write("a.yaml", std::string("kind: procedural\nscael: 1\n"))),
            path("a.yaml") + ":2:1: unknown key 'scael'; did you mean 'scale'?");
  EXPECT_EQ(error_of(write("b.yaml", std::string("relief:\n  rugae_hight_mm: 3\n"))),
            path("b.yaml") + ":2:3: unknown key 'rugae_hight_mm'; did you mean 'rugae_height_mm'?");
  EXPECT_EQ(error_of(write("c.yaml", std::string("scale: 7\n"))),
            path("c.yaml") + ": scale is 7, expected 0.3 to 2");
  EXPECT_EQ(error_of(write("d.yaml", std::string("kind: mesh\n"))),
            path("d.yaml") + ":1:1: key 'mesh' is missing");
  EXPECT_EQ(error_of(write("e.yaml", std::string("relief: {rugae_spacing_mm: .nan}\n")))
                .substr(0, path("e.yaml").size()),
            path("e.yaml"));
  EXPECT_EQ(error_of(write("f.yaml", std::string("kind: mesh\nmesh: a.ply\nscale: 1\n"))),
            path("f.yaml") + ":3:1: unknown key 'scale'");
}

TEST_F(SceneFiles, LikeTakesWhatIsNotGiven) {
  write("base.yaml", std::string("scale: 0.6\nrelief: {rugae_height_mm: 2, areae_size_mm: 2.5}\n"
                                 "mucosa: {wetness: {uniform: [0.3, 0.8]}, oil: 0.25}\n"
                                 "lesions: {polyp: 3, ulcer: 2}\n"
                                 "deformation: {peristalsis: true, amplitude_mm: 5}\n"));
  const auto read = [&](const std::string& name, const std::string& text) {
    return read_scene_file(write(name, text), 4);
  };
  const SceneFile base = read_scene_file(path("base.yaml"), 4);
  const SceneFile mine = read("mine.yaml",
                              "like: base.yaml\nrelief: {rugae_height_mm: 1}\n"
                              "lesions: {ulcer: 0}\ndeformation: {amplitude_mm: 4}\n");
  EXPECT_EQ(mine.stomach.scale, 0.6);
  EXPECT_EQ(mine.stomach.relief.rugae_height_mm, 1.0);
  EXPECT_EQ(mine.stomach.relief.areae_size_mm, 2.5);
  EXPECT_EQ(mine.mucosa.wetness, base.mucosa.wetness);  // the same draw
  EXPECT_TRUE(mine.mucosa.wetness >= 0.3 && mine.mucosa.wetness <= 0.8);
  EXPECT_EQ(mine.mucosa.oil, 0.25);
  EXPECT_EQ(mine.stomach.instances.polyp, 3);
  EXPECT_EQ(mine.stomach.instances.ulcer, 0);
  EXPECT_TRUE(mine.deformation.peristalsis);
  EXPECT_EQ(mine.deformation.amplitude_mm, 4.0);
  // a value in place of a draw, and a draw in place of a value
  const SceneFile other = read("other.yaml",
                               "like: base.yaml\nmucosa: {wetness: 0.9}\n"
                               "lesions: {polyp: {uniform: [10, 20]}}\n");
  EXPECT_EQ(other.mucosa.wetness, 0.9);
  EXPECT_TRUE(other.stomach.instances.polyp >= 10 && other.stomach.instances.polyp <= 20);
}

TEST_F(SceneFiles, WhatIsResolvedBuildsOnNothing) {
  fs::create_directories(path("base"));
  fs::create_directories(path("elsewhere"));
  write("base/ico.ply", icosahedron(60.0));
  write("base/mesh.yaml", std::string("kind: mesh\nmesh: ico.ply\ntarget_edge_mm: 4\n"));
  write("base/drawn.yaml", std::string("like: stomach-lesions\nvariation: {uniform: [0.2, 0.8]}\n"
                                       "lesions: {polyp: {uniform: [1, 9]}}\n"));
  for (const std::string name : {"base/mesh.yaml", "base/drawn.yaml"}) {
    const Scene scene =
        load(write("mine.yaml", "like: " + name + "\nmucosa: {wetness: {normal: [0.5, 0.1]}}\n"));
    EXPECT_EQ(scene.name, "mine");
    EXPECT_EQ(scene.resolved_yaml.find("like"), std::string::npos) << scene.resolved_yaml;
    fs::rename(path(name), path("gone.yaml"));  // its base is needed no more
    const Scene again = load(write("elsewhere/again.yaml", scene.resolved_yaml));
    EXPECT_EQ(again.resolved_yaml, scene.resolved_yaml);
    EXPECT_EQ(again.wall.vertices, scene.wall.vertices);
  }
  // also where the mesh is named from the folder the program runs in
  write("base/mesh.yaml", std::string("kind: mesh\nmesh: ico.ply\ntarget_edge_mm: 4\n"));
  const fs::path here = fs::current_path();
  fs::current_path(path("base"));
  const Scene scene = load("./mesh.yaml");
  fs::current_path(here);
  EXPECT_EQ(load(write("elsewhere/again.yaml", scene.resolved_yaml)).wall.vertices,
            scene.wall.vertices);
}

TEST_F(SceneFiles, ThePresetsAreTheStomachAndWhatTheySay) {
  const SceneFile stomach = read_scene_file(find_preset("scenes", "scene", "stomach"), 1);
  for (const std::string& name : preset_names("scenes")) {
    if (name == "chessboard") continue;
    SceneFile other = read_scene_file(find_preset("scenes", "scene", name), 1);
    EXPECT_EQ(other.deformation.peristalsis, name == "stomach-moving");
    EXPECT_EQ(other.stomach.instances.polyp > 0, name == "stomach-lesions");
    EXPECT_EQ(other.stomach.instances.bubbles > 0, name == "stomach-unclean");
    other.deformation = stomach.deformation;
    other.stomach.instances = stomach.stomach.instances;
    EXPECT_EQ(resolved_yaml(other), resolved_yaml(stomach)) << name;
  }
}

TEST_F(SceneFiles, WrongLikesAreNamedByLineAndColumn) {
  EXPECT_EQ(error_of(write("a.yaml", std::string("scale: 1\nlike: a.yaml\n"))),
            path("a.yaml") + ":2:7: like goes in a circle");
  write("b.yaml", std::string("like: c.yaml\n"));
  EXPECT_EQ(error_of(write("c.yaml", std::string("like: b.yaml\n"))),
            path("b.yaml") + ":1:7: like goes in a circle");
  EXPECT_EQ(error_of(write("d.yaml", std::string("like: stomch\n"))),
            path("d.yaml") +
                ":1:7: like: scene 'stomch': no such preset; did you mean 'stomach'?; known: "
                "chessboard, stomach, stomach-lesions, stomach-moving, stomach-unclean");
  EXPECT_EQ(error_of(write("e.yaml", std::string("like: none.yaml\n"))),
            path("e.yaml") + ":1:7: like: scene '" + path("none.yaml") + "': no such file");
  // what is wrong in the other file is told of the other file
  write("f.yaml", std::string("mucosa:\n  wetnes: 1\n"));
  EXPECT_EQ(error_of(write("g.yaml", std::string("like: f.yaml\nmucosa: {oil: 1}\n"))),
            path("f.yaml") + ":2:3: unknown key 'wetnes'; did you mean 'wetness'?");
  EXPECT_EQ(error_of(write("h.yaml", std::string("liek: stomach\n"))),
            path("h.yaml") + ":1:1: unknown key 'liek'; did you mean 'like'?");
}

TEST_F(SceneFiles, ValuesAreDrawnBySeedAndKept) {
  const auto file = write("drawn.yaml", std::string(R"(mucosa:
  wetness: {uniform: [0.3, 0.8]}
  vessel_contrast: {normal: [0.4, 0.1]}
  mottle_contrast: {choice: [0.1, 0.2]}
relief: {areae_size_mm: {uniform: [2, 4]}}
lesions: {erosion: {uniform: [0, 3]}, polyp: {choice: [1, 2]}}
)"));
  const auto resolved = [&](std::uint64_t seed) {
    return YamlReader::from_text(
        load_scene({.name_or_path = file, .seed = seed, .resolution = "coarse", .oil = 0.0})
            .resolved_yaml,
        "resolved");
  };
  std::set<double> wet;
  std::set<int> erosions;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    YamlReader yaml = resolved(seed), mucosa = *yaml.child("mucosa"),
               lesions = *yaml.child("lesions");
    double wetness = 0.0, vessels = 0.0, mottle = 0.0;
    int erosion = -1, polyp = -1;
    mucosa.require("wetness", wetness);
    mucosa.require("vessel_contrast", vessels);
    mucosa.require("mottle_contrast", mottle);
    lesions.require("erosion", erosion);
    lesions.require("polyp", polyp);
    EXPECT_TRUE(wetness >= 0.3 && wetness <= 0.8) << wetness;
    EXPECT_TRUE(vessels >= 0.2 && vessels <= 0.6) << vessels;  // two deviations
    EXPECT_TRUE(mottle == 0.1 || mottle == 0.2) << mottle;
    EXPECT_TRUE(erosion >= 0 && erosion <= 3) << erosion;
    EXPECT_TRUE(polyp == 1 || polyp == 2) << polyp;
    wet.insert(wetness);
    erosions.insert(erosion);
  }
  EXPECT_EQ(wet.size(), 6u);
  EXPECT_GE(erosions.size(), 2u);
  // what was drawn, read again with the same seed, is the same scene
  const Scene scene = load(file);
  const Scene again = load(write("again.yaml", scene.resolved_yaml));
  EXPECT_EQ(again.resolved_yaml, scene.resolved_yaml);
  EXPECT_EQ(again.wall.vertices, scene.wall.vertices);
  const Vec3f p = scene.wall.vertices[100].cast<float>(), n = scene.wall.normals[100];
  EXPECT_EQ(again.mucosa.sample(p, n, Region::body, 0.1f).albedo,
            scene.mucosa.sample(p, n, Region::body, 0.1f).albedo);
}

TEST_F(SceneFiles, WrongDistributionsAreToldInOneLine) {
  const auto error = [&](const std::string& value) {
    return error_of(write("wrong.yaml", "mucosa:\n  wetness: " + value + "\n"))
        .substr(path("wrong.yaml").size());
  };
  EXPECT_EQ(error("{uniform: [0.8, 0.3]}"),
            ":2:22: uniform is [0.8, 0.3], expected the least value first");
  EXPECT_EQ(error("{uniform: [0.1, 0.3], choice: [0.2]}"),
            ":2:12: wetness has 2 distributions, expected one of: uniform, normal, choice");
  EXPECT_EQ(error("{}"),
            ":2:12: wetness has 0 distributions, expected one of: uniform, normal, choice");
  EXPECT_EQ(error("{uniforn: [0.1, 0.3]}"),
            ":2:13: unknown key 'uniforn'; did you mean 'uniform'?");
  EXPECT_EQ(error("{normal: [0.5, -1]}"),
            ":2:21: normal is [0.5, -1], expected a deviation of at least 0");
  EXPECT_EQ(error("{choice: []}"), ":2:21: choice is empty, expected at least one value");
  EXPECT_EQ(error("{uniform: [2, 3]}").substr(0, 21), ": mucosa: wetness is ");
  EXPECT_EQ(error_of(write("w.yaml", std::string("lesions: {polyp: {choice: [1.5]}}\n")))
                .substr(path("w.yaml").size()),
            ":1:27: polyp is 1.5, expected a whole number");
  EXPECT_EQ(error_of(write("v.yaml", std::string("variation: 2\n"))),
            path("v.yaml") + ": variation is 2, expected 0 to 1");
}

TEST_F(SceneFiles, TheExampleIsValidAndShowsTheDefaults) {
  write("stomach.ply", icosahedron(60.0));
  const auto example = write("mesh.yaml", read_text(preset_root() / "scenes/examples/mesh.yaml"));
  EXPECT_EQ(load(example).wall.vertices, load(path("stomach.ply")).wall.vertices);
}

TEST(RealDataScene, TheAnatomicalStomachBecomesAWall) {
  const fs::path file = shared_data() / "meshes/stomach_bodyparts3d_FMA7148.ply";
  if (!fs::exists(file)) GTEST_SKIP() << "no " << file;
  const Scene scene =
      load_scene({.name_or_path = file.string(), .seed = 1, .resolution = "medium", .oil = 0.0});
  expect_whole(scene);
  EXPECT_TRUE(scene.notes.empty());
  EXPECT_NEAR(static_cast<double>(scene.wall.triangles.size()), 250e3, 25e3);
  const TriangleMesh source = read_mesh(file);
  // its README: 578 ml, box 141.7 x 115.2 x 120.2 mm; the folds take a little of the volume
  EXPECT_NEAR(signed_volume_mm3(source) / 1000.0, 578.0, 1.0);
  EXPECT_TRUE(signed_volume_mm3(scene.wall) / signed_volume_mm3(source) <= 1.0);
  EXPECT_TRUE(signed_volume_mm3(scene.wall) / signed_volume_mm3(source) >= 0.9);
  EXPECT_NEAR(bounding_box(scene.wall).sizes().x(), 141.7, 3.0);
  const ClosestPoint closest(source);
  double farthest = 0.0;
  for (std::size_t v = 0; v < scene.wall.vertices.size(); v += 53)
    farthest = std::max(farthest, closest(scene.wall.vertices[v]).distance_mm);
  EXPECT_LE(farthest, 6.0);  // the height of a fold, and what rounding off the facets takes
}

}  // namespace
}  // namespace rugae
