#include "studies/study_file.h"

#include <gtest/gtest.h>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "studies/cell.h"

namespace rugae {
namespace {

const std::string kHead = "cameras: [misumi-v5506]\ntrajectories: [\"1\", \"2\"]\n";

std::string error_of(const std::string& text) {
  try {
    read_study_text(text, "study.yaml");
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(StudyFile, ReadsWhatItSays) {
  const StudyOptions study =
      read_part_text(kHead +
                         "title: A title\nframes: 30\nseed: 7\nrender: {sensor: {noise: "
                         "false}}\nresolution: coarse\n"
                         "gates: [{metric: tracking.tracked_share, above: 0.5, reason: why}]\n",
                     "study.yaml");
  EXPECT_EQ(study.title, "A title");
  ASSERT_EQ(study.variants.size(), 1u);
  const SimulateOptions& simulate = study.variants[0].simulate;
  EXPECT_EQ(simulate.frames, 30);
  EXPECT_EQ(study.seeds, (std::vector<std::uint64_t>{7}));
  EXPECT_FALSE(simulate.render.sensor.noise);
  EXPECT_EQ(simulate.resolution, "coarse");
  ASSERT_EQ(study.gates.size(), 1u);
  EXPECT_EQ(study.gates[0].above, 0.5);
  EXPECT_FALSE(study.gates[0].below);
  const auto cells = cells_of(study);
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_EQ(cells[1].name(), "misumi-v5506_2_paper");
}

TEST(StudyFile, AnUnknownKeyIsNamedWithLineAndColumn) {
  EXPECT_EQ(error_of(kHead + "frame: 30\n"),
            "study.yaml:3:1: unknown key 'frame'; did you mean 'frames'?");
}

TEST(StudyFile, CellsShownInFullKeepTheirFrames) {
  EXPECT_EQ(read_part_text(kHead, "study.yaml").keep, Keep::all);
  EXPECT_EQ(read_part_text(kHead + "details: false\nkeep: results\n", "study.yaml").keep,
            Keep::results);
  EXPECT_EQ(read_part_text(kHead + "measure: vignetting\nkeep: results\n", "study.yaml").keep,
            Keep::results);  // single stages have no details
  EXPECT_EQ(error_of(kHead + "keep: results\n"),
            "study.yaml:3:7: keep is results, expected details: false beside it: a cell's details "
            "show its frames");
  EXPECT_EQ(error_of(kHead + "keep: nothing\n"),
            "study.yaml:3:7: keep is 'nothing', expected one of: all, results");
}

TEST(StudyFile, AMissingOrUnknownPresetIsNamed) {
  EXPECT_EQ(error_of("trajectories: [\"1\"]\n"), "study.yaml:1:1: key 'cameras' is missing");
  const std::string error = error_of("cameras: [misumi-v550]\ntrajectories: [\"1\"]\n");
  EXPECT_EQ(error.substr(0, error.find("; known")),
            "study.yaml:1:10: camera 'misumi-v550': no such preset; did you mean 'misumi-v5506'?");
}

TEST(StudyFile, AGateNeedsABoundAndAReason) {
  EXPECT_EQ(error_of(kHead + "gates: [{metric: a.b, reason: why}]\n"),
            "study.yaml:3:18: gate on a.b has no bound, expected above or below");
  EXPECT_EQ(error_of(kHead + "gates: [{metric: a.b, below: 1}]\n"),
            "study.yaml:3:9: key 'reason' is missing");
}

TEST(StudyFile, NegativeFramesAreRefused) {
  EXPECT_EQ(error_of(kHead + "frames: -3\n"),
            "study.yaml:3:9: frames is -3, expected at least 0 (0: as in the paper)");
}

TEST(StudyFile, EveryPresetReads) {
  for (const std::string& name : preset_names("studies")) {
    SCOPED_TRACE(name);
    for (const StudyOptions& part : read_study(find_preset("studies", "study", name)).parts)
      EXPECT_FALSE(cells_of(part).empty());
  }
}

// Axes reach every setting of the file, by its path; the file's own value stands elsewhere.
TEST(StudyFile, AxesMakeEveryCombination) {
  const StudyOptions study = read_part_text(
      "cameras: [misumi-v5506]\ntrajectories: [\"1\"]\nseeds: [3, 5]\n"
      "recon: {keyframes: {max_gap: 7}}\n"
      "axes:\n  recon.preprocess.undistort: [true, false]\n  render.sensor.noise: [false]\n"
      "  frames: [12, 24]\n",
      "study.yaml");
  ASSERT_EQ(study.variants.size(), 4u);
  const std::vector<std::pair<bool, int>> expected = {
      {true, 12}, {true, 24}, {false, 12}, {false, 24}};
  for (std::size_t v = 0; v < 4; ++v) {
    const Variant& variant = study.variants[v];
    EXPECT_EQ(variant.recon.preprocess.undistort, expected[v].first);
    EXPECT_EQ(variant.simulate.frames, expected[v].second);
    EXPECT_FALSE(variant.simulate.render.sensor.noise);
    EXPECT_EQ(variant.recon.keyframes.max_gap, 7);
  }
  const auto cells = cells_of(study);
  ASSERT_EQ(cells.size(), 8u);
  EXPECT_EQ(cells[3].title(),
            "misumi-v5506, trajectory 1, paper, recon.preprocess.undistort=true, "
            "render.sensor.noise=false, frames=24, seed 5");
  EXPECT_EQ(cells[3].name(), "misumi-v5506_1_paper_v2_seed5");
}

TEST(StudyFile, ABadAxisIsNamedWithItsPlace) {
  const auto axes = [](const std::string& text) { return kHead + "axes: {" + text + "}\n"; };
  EXPECT_EQ(error_of(axes("recon.preprocess.undistrt: [true]")),
            "study.yaml:3:35: axis recon.preprocess.undistrt=true: unknown key 'undistrt'; did you "
            "mean 'undistort'?");
  EXPECT_EQ(error_of(axes("frames: [10, ten]")),
            "study.yaml:3:16: axis frames=ten: frames is 'ten', expected a whole number");
  EXPECT_EQ(error_of(axes("frames: []")),
            "study.yaml:3:16: axis 'frames' is empty, expected at least one value");
  EXPECT_EQ(error_of(axes("frames: [10, 10]")), "study.yaml:3:16: axis 'frames': 10 stands twice");
  EXPECT_EQ(error_of(axes("frames.more: [10]")),
            "study.yaml:3:21: axis frames.more=10: frames is a mapping, expected a whole number");
  EXPECT_EQ(
      error_of(axes("cameras: [misumi-v3506]")),
      "study.yaml:3:17: axis 'cameras': cameras, trajectories, methods and seeds have lists of "
      "their own");
  EXPECT_EQ(error_of(axes("rendr.sensor.noise: [true]")),
            "study.yaml:3:28: axis 'rendr.sensor.noise': no such setting, expected one of: render, "
            "recon, scene, camera, resolution, frames, first, calibrate, lens_error, replace; did "
            "you mean "
            "'render'?");
  EXPECT_EQ(error_of(kHead + "seeds: [1, 2, 1]\n"), "study.yaml:3:8: seed 1 stands twice");
  EXPECT_EQ(error_of(kHead + "seed: 1\nseeds: [2]\n"),
            "study.yaml:4:8: seed and seeds, expected one of them");
}

TEST(StudyFile, AGateCanHoldForSomeOfTheAxes) {
  const std::string head = kHead + "axes: {frames: [12, 24]}\n";
  const auto gate = [&](const std::string& where) {
    return head + "gates: [{metric: a.b, below: 1, reason: why, where: {" + where + "}}]\n";
  };
  const StudyOptions study = read_part_text(gate("frames: 24"), "study.yaml");
  ASSERT_EQ(study.gates.size(), 1u);
  EXPECT_EQ(study.gates[0].settings, (std::vector<Setting>{{"frames", "24"}}));
  EXPECT_EQ(error_of(gate("frames: 25")),
            "study.yaml:4:62: 25 is no value of the axis 'frames': 12, 24");
  EXPECT_EQ(error_of(gate("frame: 24")),
            "study.yaml:4:61: 'frame' is no axis of the study; did you mean 'frames'?");
}

// A name of its own makes an axis of bundles; a mapping for the scene builds on the one that is
// named; a value may be a list or a mapping.
TEST(StudyFile, AxesOfBundlesAndOfTheScene) {
  const StudyOptions study = read_part_text(
      "cameras: [misumi-v5506]\ntrajectories: [\"1\"]\n"
      "axes:\n"
      "  preprocessing:\n"
      "    none: {recon.preprocess.undistort: false, recon.preprocess.devignette: false}\n"
      "    all: {}\n"
      "  scene.mucosa.wetness: [0.1, 0.9]\n",
      "study.yaml");
  ASSERT_EQ(study.variants.size(), 4u);
  EXPECT_FALSE(study.variants[0].recon.preprocess.undistort);
  EXPECT_FALSE(study.variants[1].recon.preprocess.devignette);
  EXPECT_TRUE(study.variants[2].recon.preprocess.undistort);
  EXPECT_EQ(study.variants[0].simulate.scene, "stomach");
  EXPECT_NE(study.variants[0].scene_text.find("wetness: 0.1"), std::string::npos)
      << study.variants[0].scene_text;
  EXPECT_NE(study.variants[3].scene_text.find("wetness: 0.9"), std::string::npos);
  const auto cells = cells_of(study);
  EXPECT_EQ(cells[1].title(),
            "misumi-v5506, trajectory 1, paper, preprocessing=none, scene.mucosa.wetness=0.9");

  const auto axes = [](const std::string& text) { return kHead + "axes: {" + text + "}\n"; };
  EXPECT_EQ(error_of(axes("scene.mucosa.wetnes: [0.1]")),
            "study.yaml:3:29: axis scene.mucosa.wetnes=0.1: unknown key 'wetnes'; did you mean "
            "'wetness'?");
  EXPECT_EQ(error_of(axes("steps: {a: {recn.undistort: true}}")),
            "study.yaml:3:36: axis 'recn.undistort': no such setting, expected one of: render, "
            "recon, scene, camera, resolution, frames, first, calibrate, lens_error, replace; did "
            "you mean "
            "'recon'?");
  EXPECT_EQ(error_of(axes("recon.map.voxel_share: {a: 0.1}")),
            "study.yaml:3:31: axis 'recon.map.voxel_share' is a mapping, expected a list of its "
            "values; only an axis with a name of its own has names for its values");
  EXPECT_EQ(error_of(axes("camera.sensor.read_noise: [5]")),
            "study.yaml:3:34: axis camera.sensor.read_noise=5: camera 'misumi-v5506': unknown key "
            "'read_noise'; did you mean 'read_noise_e'?");
  EXPECT_EQ(error_of(kHead + "scene: {like: stomach, mucossa: {}}\n"),
            "study.yaml:3:8: unknown key 'mucossa'; did you mean 'mucosa'?");
}

TEST(StudyFile, SummariesNameWhatCellsDifferIn) {
  const std::string head = kHead + "axes: {frames: [12, 24], steps: {a: {}, b: {frames: 9}}}\n";
  const auto table = [&](const std::string& more) {
    return head + "tables: [{title: T, metric: a.b, " + more + "}]\n";
  };
  EXPECT_EQ(error_of(table("rows: steps, columns: frames, published: ate")), "no error");
  EXPECT_EQ(error_of(table("rows: step")),
            "study.yaml:4:40: rows is 'step', expected one of: camera, trajectory, method, seed, "
            "frames, steps; did you mean 'steps'?");
  EXPECT_EQ(error_of(table("method: papr")),
            "study.yaml:4:42: method is 'papr', expected one of: paper; did you mean 'paper'?");
  EXPECT_EQ(
      error_of(table("published: at")),
      "study.yaml:4:45: published is 'at', expected one of: ate, ate_preprocessing, features, "
      "map, map_preprocessing, time, time_of_pair; did you mean 'ate'?");
  EXPECT_EQ(error_of(head + "curves: [{title: T, metric: a.b, over: steps}]\n"),
            "study.yaml:4:40: the axis 'steps' has the value 'a', expected numbers");
  EXPECT_EQ(error_of(head + "bars: [{title: T, metric: a.b, over: camera}]\n"),
            "study.yaml:4:38: over is 'camera', expected an axis of the study");
  EXPECT_EQ(error_of(head + "findings: [{claim: C, metric: a.b, more: {steps: c}, less: {steps: "
                            "a}}]\n"),
            "study.yaml:4:50: 'c' is no value of the axis 'steps': a, b");
  EXPECT_EQ(error_of(head + "findings: [{claim: C, metric: a.b, more: {steps: a}, less: {frames: "
                            "12}}]\n"),
            "study.yaml:4:60: less is of 'frames' and more of 'steps', expected one");
}

// Parts are studies of their own, each with changes.
TEST(StudyFile, PartsAreOtherStudies) {
  const std::string parts =
      "title: Two\nparts:\n  - {study: demo, with: {frames: 12, cameras: [misumi-v5506, "
      "awaiba-naneye], gates: []}}\n  - {study: trajectories, name: six}\n";
  const Study study = read_study_text(parts, "study.yaml");
  EXPECT_EQ(study.title, "Two");
  ASSERT_EQ(study.parts.size(), 2u);
  EXPECT_EQ(study.parts[0].variants[0].simulate.frames, 12);
  EXPECT_TRUE(study.parts[0].gates.empty());
  EXPECT_EQ(cells_of(study.parts[0]).size(), 2u);
  EXPECT_EQ(cells_of(study.parts[0])[1].name(), "demo_awaiba-naneye_inspection_paper");
  EXPECT_EQ(cells_of(study.parts[1]).front().part, "six");

  EXPECT_EQ(error_of("title: T\nparts: [{study: demoo}]\n").substr(0, 49),
            "study.yaml:2:17: study 'demoo': no such preset; d");
  EXPECT_EQ(error_of("title: T\nparts: [{study: demo}, {study: demo}]\n"),
            "study.yaml:2:32: two parts have the name 'demo'; give one another `name`");
  EXPECT_EQ(error_of("title: T\nparts: []\n"),
            "study.yaml:2:8: parts is empty, expected at least one");
  EXPECT_EQ(error_of("title: T\nframes: 3\nparts: [{study: demo}]\n"),
            "study.yaml:2:1: unknown key 'frames'");
  const std::string wrong = error_of("title: T\nparts: [{study: demo, with: {frame: 3}}]\n");
  EXPECT_TRUE(wrong.starts_with("study.yaml:2:29: part 'demo' with its changes: ")) << wrong;
  EXPECT_NE(wrong.find("unknown key 'frame'; did you mean 'frames'?"), std::string::npos) << wrong;
}

// The example of docs/studies.md, word for word.
TEST(StudyFile, TheExampleOfTheDocsReads) {
  const std::string page = read_text(preset_root() / "docs" / "studies.md");
  const std::string open = "```yaml\n";
  const std::size_t begin = page.find(open);
  ASSERT_NE(begin, std::string::npos);
  const std::string text =
      page.substr(begin + open.size(), page.find("```", begin + open.size()) - begin - open.size());
  EXPECT_EQ(cells_of(read_part_text(text, "docs/studies.md")).size(), 48u);
}

}  // namespace
}  // namespace rugae
