// The program as a user meets it: bad input ends in one line and a documented exit code.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "core/files.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr int kDone = 0, kBadInput = 2, kNotAsAsked = 3;

struct Outcome {
  int code = -1;
  std::string out, error;
};

class CommandLine : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome rugae(const std::string& arguments) const {
    const fs::path out = folder_ / "stdout.txt", error = folder_ / "stderr.txt";
    const std::string command = std::string("cd '") + folder_.string() + "' && '" + RUGAE_PROGRAM +
                                "' " + arguments + " >'" + out.string() + "' 2>'" + error.string() +
                                "'";
    const int status = std::system(command.c_str());
    Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(out), read_text(error)};
    if (!outcome.error.empty() && outcome.error.back() == '\n') outcome.error.pop_back();
    return outcome;
  }
  void expect_refused(const std::string& arguments, const std::string& message) const {
    const Outcome outcome = rugae(arguments);
    EXPECT_EQ(outcome.code, kBadInput) << arguments;
    // Stages that ended before stand above it.
    const std::string last = outcome.error.substr(outcome.error.rfind('\n') + 1);
    EXPECT_EQ(last, "rugae: " + message) << arguments;
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  fs::path small_dataset() const {
    write("tiny.yaml", kTinyCamera);
    const Outcome made = rugae(kSmallDataset);
    EXPECT_EQ(made.code, kDone) << made.error;
    return folder_ / "data";
  }

  static constexpr const char* kSmallDataset =
      "simulate --resolution coarse --camera tiny.yaml --trajectory 1 --frames 4 --out data";
  static constexpr const char* kTinyCamera =
      "lens: {width: 64, height: 48, horizontal_fov_deg: 100, k1: -0.05}\n"
      "sensor: {pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, read_noise_e: 10}\n";
  fs::path folder_ =
      fs::temp_directory_path() /
      ("rugae_cli_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST_F(CommandLine, HelpAndVersion) {
  EXPECT_EQ(rugae("--help").code, kDone);
  EXPECT_EQ(rugae("simulate --help").code, kDone);
  EXPECT_EQ(rugae("--version").code, kDone);
}

TEST_F(CommandLine, UnknownCommandsAndOptionsOfferTheNearest) {
  expect_refused("simualte",
                 "'simualte': no such command; did you mean 'simulate'?; known: simulate, "
                 "calibrate, reconstruct, "
                 "evaluate, run, check, picture, export, list");
  expect_refused("simulate --camrea x --out y",
                 "simulate: unknown option '--camrea'; did you mean '--camera'?");
  expect_refused("simulate --frames=3 --out x --bogus",
                 "simulate: unknown option '--bogus'; did you mean '--out'?");
  expect_refused("simulate --frames=3 --outt=x",
                 "simulate: unknown option '--outt'; did you mean '--out'?");
  expect_refused("--threads=2 simulate --out x",
                 "'--threads=2': no such option before a command; see rugae --help");
  expect_refused("simulate", "simulate: --out is required; see rugae simulate --help");
  expect_refused("simulate --seed -1 --out x",
                 "simulate: --seed: '-1', expected 0, 1, 2 ...; see rugae simulate --help");
  expect_refused("simulate --only-frame 1.5 --out x",
                 "simulate: --only-frame: '1.5', expected 0, 1, 2 ...; see rugae simulate --help");
  expect_refused("list camera",
                 "list 'camera': no such kind; did you mean 'cameras'?; known: scenes, cameras, "
                 "rigs, trajectories, studies, formats");
}

TEST_F(CommandLine, MisspeltCameraOffersTheNearest) {
  expect_refused(
      "simulate --camera misumi-v550 --out out",
      "camera 'misumi-v550': no such preset; did you mean 'misumi-v5506'?; known: awaiba-naneye, "
      "misumi-v3506, misumi-v5506, potensic-mini");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(CommandLine, MissingMesh) {
  expect_refused("simulate --scene nowhere.ply --out out", "nowhere.ply: no such mesh file");
}

TEST_F(CommandLine, MeshWithoutTriangles) {
  write("points.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\n"
        "end_header\n0 0 0\n1 0 0\n0 1 0\n");
  expect_refused("simulate --scene points.ply --out out", "points.ply: no triangles");
}

TEST_F(CommandLine, MeshWithAVertexThatIsNotFinite) {
  write(
      "nan.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 nan 0\n0 1 0\n"
      "3 0 1 2\n");
  expect_refused("simulate --scene nan.ply --out out",
                 "nan.ply: vertex 1 is not finite (1, nan, 0)");
}

TEST_F(CommandLine, UnknownYamlKeyHasLineAndColumn) {
  write("tiny.yaml", "lens: {width: 64, height: 48, horizontal_fov_deg: 100}\nsensr: 3\n");
  expect_refused("simulate --camera tiny.yaml --out out", "tiny.yaml:1:1: key 'sensor' is missing");
  write("study.yaml", "frames: 4\ncamreas: [misumi-v5506]\n");
  expect_refused("run study.yaml --out out",
                 "study.yaml:2:1: unknown key 'camreas'; did you mean 'cameras'?");
}

TEST_F(CommandLine, OutputFolderThatCannotBe) {
  write("file", "x");
  expect_refused("simulate --out file/out",
                 "file/out: output folder cannot be created: Not a directory");
}

TEST_F(CommandLine, ExportsSayWhatTheirReaderShouldKnow) {
  small_dataset();
  const Outcome made = rugae("export data --format nerfstudio --out theirs --json");
  ASSERT_EQ(made.code, kDone) << made.error;
  const auto said = nlohmann::json::parse(made.out);
  EXPECT_EQ(said["frames"], 4);
  EXPECT_EQ(said["notes"][0],
            "depth in steps of 0.005 mm, up to 327.7 mm: --depth-unit-scale-factor 5e-06");
  EXPECT_TRUE(fs::exists(folder_ / "theirs" / "transforms.json"));
  expect_refused("export data --format nerfstudoi --out other",
                 "format 'nerfstudoi': no such format; did you mean 'nerfstudio'?; known: tum, "
                 "colmap, nerfstudio, c3vd");
  expect_refused("export data --format tum --out theirs",
                 "theirs: holds another export (dataset, format or depth-per-mm differ); choose "
                 "another folder or remove it");
  EXPECT_NE(rugae("list formats").out.find("c3vd"), std::string::npos);
}

TEST_F(CommandLine, AllLabelsMeansAll) {
  write("tiny.yaml", kTinyCamera);
  write("none.yaml", "labels: false\n");
  const Outcome made = rugae(std::string(kSmallDataset) + " --options none.yaml --all-labels");
  EXPECT_EQ(made.code, kDone) << made.error;
  EXPECT_TRUE(fs::exists(folder_ / "data" / "truth" / "albedo" / "000000.exr"));
}

TEST_F(CommandLine, DamagedDatasetsAreNamed) {
  const fs::path data = small_dataset();
  EXPECT_EQ(rugae("check data").code, kDone);

  const fs::path frame = data / "observations" / "frames" / "000002.png";
  const std::string whole = read_text(frame);
  write("data/observations/frames/000002.png", whole.substr(0, whole.size() / 2));
  const Outcome truncated = rugae("check data");
  EXPECT_EQ(truncated.code, kBadInput);
  EXPECT_NE(truncated.out.find("data/observations/frames/000002.png: truncated or not an image"),
            std::string::npos)
      << truncated.out;
  expect_refused("reconstruct data --out est",
                 "data/observations/frames/000002.png: truncated or not an image");
  write("data/observations/frames/000002.png", whole);

  std::string track = read_text(data / "truth" / "trajectory.txt");
  track[track.size() - 2] = track[track.size() - 2] == '1' ? '2' : '1';
  write("data/truth/trajectory.txt", track);
  const Outcome changed = rugae("check data --json");
  EXPECT_EQ(changed.code, kBadInput);
  const auto problems = nlohmann::json::parse(changed.out).at("problems");
  ASSERT_GE(problems.size(), 1u);
  EXPECT_NE(problems[0].get<std::string>().find("data/truth/trajectory.txt"), std::string::npos)
      << problems;
}

TEST_F(CommandLine, CheckReadsAFolderThatOthersMade) {
  write("tiny.yaml", kTinyCamera);
  write("short.yaml", "like: '1'\nlength_cm: 8\npasses: 1\n");
  const Outcome made = rugae(
      "simulate --resolution coarse --camera tiny.yaml --trajectory short.yaml --frames 8 --out "
      "data");
  ASSERT_EQ(made.code, kDone) << made.error;
  fs::create_directories(folder_ / "theirs");
  fs::rename(folder_ / "data/observations/frames", folder_ / "theirs/rgb");
  fs::rename(folder_ / "data/truth/depth", folder_ / "theirs/depth");
  fs::rename(folder_ / "data/truth/trajectory.txt", folder_ / "theirs/path.txt");
  fs::rename(folder_ / "data/observations/calibration.yaml", folder_ / "theirs/lens.yaml");
  const Outcome sound = rugae("check theirs --poses theirs/path.txt");
  EXPECT_EQ(sound.code, kDone) << sound.out;
  EXPECT_EQ(sound.out, "theirs: 8 frames, 18 files, sound\n");
  const Outcome scaled = rugae("check theirs --poses theirs/path.txt --depth-scale 0.001");
  EXPECT_EQ(scaled.code, kBadInput);
  EXPECT_EQ(scaled.out.substr(0, scaled.out.find(": depth led")),
            "theirs/path.txt: the poses are wrong: they are in millimetres where the depth is in "
            "metres (a factor 1000)");
  expect_refused("check theirs --poses nowhere.txt", "nowhere.txt: no such file or folder");
  expect_refused("check theirs --images theirs/lens.yaml",
                 "theirs/lens.yaml: is a file, expected a folder");
}

TEST_F(CommandLine, SimulateGoesOnAndSaysSoInJson) {
  small_dataset();
  const Outcome again = rugae(
      "simulate --resolution coarse --camera tiny.yaml --trajectory 1 --frames 4 --out data "
      "--json");
  EXPECT_EQ(again.code, kDone);
  const auto json = nlohmann::json::parse(again.out);
  EXPECT_EQ(json.at("frames"), 4);
  EXPECT_EQ(json.at("skipped"), 4);
  const Outcome other = rugae(
      "simulate --resolution coarse --camera tiny.yaml --trajectory 1 --frames 4 --seed 2 --out "
      "data");
  EXPECT_EQ(other.code, kBadInput);
}

TEST_F(CommandLine, FewerThanTwoFrames) {
  small_dataset();
  fs::create_directories(folder_ / "one");
  fs::copy_file(folder_ / "data/observations/frames/000000.png", folder_ / "one/a.png");
  expect_refused("reconstruct one --calibration data/observations/calibration.yaml --out est",
                 "one: 1 usable frame, at least two are needed");
  fs::create_directories(folder_ / "none");
  const Outcome none =
      rugae("reconstruct none --calibration data/observations/calibration.yaml --out est");
  EXPECT_EQ(none.code, kBadInput);
}

TEST_F(CommandLine, TrajectoryThatWouldLeaveTheStomach) {
  write("wide.yaml", "length_cm: 120\nclearance_mm: 90\n");
  const Outcome outcome =
      rugae("simulate --resolution coarse --trajectory wide.yaml --frames 4 --out out");
  EXPECT_EQ(outcome.code, kBadInput);
  EXPECT_TRUE(outcome.error.find("rugae: trajectory 'wide' would leave the stomach: ") !=
              std::string::npos)
      << outcome.error;
}

TEST_F(CommandLine, FailedCellExitsWithThree) {
  write("tiny.yaml", kTinyCamera);
  write("study.yaml",
        "title: tiny\nresolution: coarse\nframes: 4\ncameras: [tiny.yaml]\ntrajectories: ['1']\n"
        "commands: {broken: ['false']}\nmethods: [broken]\n");
  const Outcome outcome = rugae("run study.yaml --out out --json");
  EXPECT_EQ(outcome.code, kNotAsAsked) << outcome.error;
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result.at("cells"), 1);
  ASSERT_EQ(result.at("failed_cells").size(), 1u);
  EXPECT_TRUE(
      result.at("failed_cells")[0].get<std::string>().starts_with("tiny, trajectory 1, broken: "));
  EXPECT_NE(outcome.error.find("cell failed: tiny, trajectory 1, broken: "), std::string::npos);
}

// A path that this stomach has no room for is its cell's failure; the others are made.
TEST_F(CommandLine, ACellThatCannotBeSimulatedFailsAlone) {
  write("tiny.yaml", kTinyCamera);
  write("wide.yaml", "length_cm: 120\nclearance_mm: 90\n");
  write("study.yaml",
        "title: tiny\nresolution: coarse\nframes: 4\ncameras: [tiny.yaml]\n"
        "trajectories: [wide.yaml, '1']\ncommands: {broken: ['false']}\nmethods: [broken]\n");
  const Outcome outcome = rugae("run study.yaml --out out --json");
  EXPECT_EQ(outcome.code, kNotAsAsked) << outcome.error;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("failed_cells").size(), 2u);
  EXPECT_NE(
      outcome.error.find("cell failed: tiny, trajectory wide, broken: trajectory 'wide' would "
                         "leave the stomach"),
      std::string::npos)
      << outcome.error;
  EXPECT_TRUE(fs::exists(folder_ / "out" / "report.html"));
  EXPECT_NE(read_text(folder_ / "out" / "junit.xml").find("failures=\"2\""), std::string::npos);
}

// What names a file lies beside the study, wherever the command is given.
TEST_F(CommandLine, AStudyNamesFilesBesideIt) {
  fs::create_directories(folder_ / "studies");
  write("studies/tiny.yaml", kTinyCamera);
  write("studies/mine.yaml", "like: stomach\n");
  write("studies/path.yaml", "like: '1'\n");
  write("studies/study.yaml",
        "title: tiny\nscene: mine.yaml\nresolution: coarse\nframes: 4\ncameras: [tiny.yaml]\n"
        "trajectories: [path.yaml]\ncommands: {broken: ['false']}\nmethods: [broken]\n");
  const Outcome outcome = rugae("run studies/study.yaml --out out");
  EXPECT_EQ(outcome.code, kNotAsAsked) << outcome.error;
  write("studies/study.yaml",
        "title: tiny\nscene: nothere\ncameras: [tiny.yaml]\ntrajectories: ['1']\n");
  const Outcome misspelt = rugae("run studies/study.yaml --out none");
  EXPECT_EQ(misspelt.code, kBadInput);
  EXPECT_TRUE(misspelt.error.starts_with(
      "rugae: studies/study.yaml:2:8: scene 'nothere': no such preset; known: "))
      << misspelt.error;
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(CommandLine, MistakesInGatesAreFoundBeforeAnyWork) {
  write("tiny.yaml", kTinyCamera);
  const std::string study =
      "title: tiny\nresolution: coarse\nframes: 4\ncameras: [tiny.yaml]\ntrajectories: ['1']\n"
      "gates:\n  - {metric: a.b, reason: why, ";
  write("camera.yaml", study + "below: 1, camera: tiny.yml}\n");
  expect_refused("run camera.yaml --out none",
                 "camera.yaml:7:50: camera is 'tiny.yml', expected one of the study's: tiny.yaml; "
                 "did you mean 'tiny.yaml'?");
  write("never.yaml", study + "above: 2, below: 1}\n");
  expect_refused("run never.yaml --out none",
                 "never.yaml:7:39: gate on a.b is above 2 and below 1, which no number is");
}

// What was changed is not called sound by making it again; what was removed is made anew.
TEST_F(CommandLine, AFinishedDatasetThatChangedIsRefused) {
  small_dataset();
  const fs::path frames = folder_ / "data/observations/frames";
  const std::string first = read_text(frames / "000000.png");
  fs::copy_file(frames / "000001.png", frames / "000000.png", fs::copy_options::overwrite_existing);
  expect_refused(kSmallDataset,
                 "data/observations/frames/000000.png: changed since the dataset was finished; "
                 "remove it, and the same command makes it anew");
  fs::remove(frames / "000000.png");
  EXPECT_EQ(rugae(kSmallDataset).code, kDone);
  EXPECT_EQ(read_text(frames / "000000.png"), first);
  write("data/notes.txt", "");
  expect_refused(kSmallDataset,
                 "data/notes.txt: is none of this finished dataset's files; move it elsewhere");
}

TEST_F(CommandLine, CheckSaysWhatItExpects) {
  expect_refused(
      "check data --depth-scale 0",
      "check: --depth-scale: expected a number above 0, not '0'; see rugae check --help");
  expect_refused(
      "check data --depth-scale mm",
      "check: --depth-scale: expected a number above 0, not 'mm'; see rugae check --help");
  small_dataset();
  fs::create_directories(folder_ / "rig");
  fs::rename(folder_ / "data", folder_ / "rig/left");
  write("rig/rig.json", "{}");
  expect_refused("check rig", "rig: the cameras of a rig, expected one of them: left");
}

TEST_F(CommandLine, AnEstimateDoesNotMixWithADataset) {
  small_dataset();
  for (const std::string folder : {"data", "data/observations"}) {
    const std::string held = folder == "data" ? "a dataset" : "frames of observations";
    expect_refused("reconstruct data --out " + folder,
                   folder + ": holds " + held + ", expected a folder of the estimate's own");
    EXPECT_FALSE(fs::exists(folder_ / folder / "trajectory.txt"));
  }
}

TEST_F(CommandLine, FailedGateExitsWithThree) {
  write("tiny.yaml", kTinyCamera);
  write("study.yaml",
        "title: tiny\nresolution: coarse\nframes: 4\ncameras: [tiny.yaml]\ntrajectories: ['1']\n"
        "methods: [paper]\ngates:\n  - {metric: tracking.tracked_share, above: 2, reason: cannot "
        "be}\n");
  const Outcome outcome = rugae("run study.yaml --out out");
  EXPECT_EQ(outcome.code, kNotAsAsked) << outcome.error;
  EXPECT_NE(outcome.error.find("gate failed: "), std::string::npos);
}

}  // namespace
}  // namespace rugae
