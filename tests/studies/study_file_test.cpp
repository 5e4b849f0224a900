#include "studies/study_file.h"

#include <gtest/gtest.h>

#include "core/check.h"
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
      read_study_text(kHead +
                          "title: A title\nframes: 30\nseed: 7\nrender: {sensor: {noise: "
                          "false}}\nresolution: coarse\n"
                          "gates: [{metric: tracking.tracked_share, above: 0.5, reason: why}]\n",
                      "study.yaml");
  EXPECT_EQ(study.title, "A title");
  EXPECT_EQ(study.simulate.frames, 30);
  EXPECT_EQ(study.simulate.seed, 7u);
  EXPECT_EQ(study.recon.seed, 7u);
  EXPECT_FALSE(study.simulate.render.sensor.noise);
  EXPECT_EQ(study.simulate.resolution, "coarse");
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
    EXPECT_FALSE(cells_of(read_study(find_preset("studies", "study", name))).empty());
  }
}

}  // namespace
}  // namespace rugae
