// Methods that are programs of their own.

#include "studies/external.h"

#include <sys/stat.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "core/check.h"
#include "core/files.h"
#include "core/pose_track.h"
#include "dataset/estimate.h"
#include "dataset/layout.h"
#include "render/simulate.h"
#include "studies/study.h"
#include "tests/studies/in_temporary_folder.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kFrames = 6;

class External : public InTemporaryFolder {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    write_atomic(folder_ / "small.yaml",
                 "name: small\nframes_in_paper: 0\ndiameter_mm: 5\n"
                 "lens: {model: brown_conrady, width: 80, height: 60, horizontal_fov_deg: 90}\n"
                 "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 10000, "
                 "read_noise_e: 5, shutter: global}\n");
    write_atomic(folder_ / "short.yaml", "like: \"1\"\nlength_cm: 4\npasses: 1\n");
  }

  // A program of the test's own, beside the study file.
  void write_program(const std::string& body) {
    const fs::path file = folder_ / "program.sh";
    write_atomic(file, "#!/bin/sh\n" + body);
    chmod(file.c_str(), 0755);
  }

  fs::path write_study(const std::string& arguments, const std::string& method = "mine") {
    const fs::path file = folder_ / "study.yaml";
    write_atomic(file, fmt::format("resolution: coarse\nframes: {1}\ncameras: [{0}/small.yaml]\n"
                                   "trajectories: [{0}/short.yaml]\nmethods: [{3}]\n"
                                   "commands: {{mine: [./program.sh, {2}]}}\n",
                                   folder_.string(), kFrames, arguments, method));
    return file;
  }

  json metrics_of(const fs::path& study) {
    Progress progress(Progress::Output::silent);
    run_study(study, folder_ / "out", {}, progress);
    return json::parse(read_text(folder_ / "out" / "results.json")).at("cells").at(0).at("metrics");
  }

  std::string failure_of(const fs::path& study) {
    const std::string text = metrics_of(study).value("failed", "it did not fail");
    return std::regex_replace(text, std::regex(folder_.string()), "F");
  }
};

// A program that knows the path: it copies the truth, which the test (not the engine) hands it,
// without the last pose.
TEST_F(External, APathIsMeasuredLikeAnyOther) {
  write_program(
      "test -f \"$1/000000.png\" && test -f \"$2\" && grep -q fx \"$3\" || exit 4\n"
      "sed '$d' \"$1/../../truth/trajectory.txt\" > \"$4/trajectory.txt\"\n"
      "echo said\n");
  const fs::path study =
      write_study("\"{frames}\", \"{frame_list}\", \"{calibration}\", \"{out}\"");
  const json metrics = metrics_of(study);
  ASSERT_FALSE(metrics.contains("failed")) << metrics.at("failed");
  EXPECT_EQ(metrics.at("tracking").at("tracked"), kFrames - 1);
  constexpr double kSame_mm = 1e-6;  // what is left of rounding after the alignment
  EXPECT_LE(metrics.at("trajectory").at("ate_sim3_rmse_mm").get<double>(), kSame_mm);
  EXPECT_TRUE(metrics.at("surface").at("trajectory_aligned").is_null());
  int logs = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "out" / "estimates"))
    if (entry.path().filename() == "command.log") {
      EXPECT_EQ(read_text(entry.path()), "said\n");
      ++logs;
    }
  EXPECT_EQ(logs, 1);
}

TEST_F(External, AFailureKeepsItsOutputAndIsTriedAgain) {
  write_program(
      "if test ! -e \"$(dirname \"$0\")/luck\"; then echo first; echo 'no such luck'; exit 3; fi\n"
      "cp \"$1\"/../../../datasets/*/truth/trajectory.txt \"$1\"\n");
  const fs::path study = write_study("\"{out}\"");
  const std::string failed = failure_of(study);
  EXPECT_TRUE(failed.starts_with("'F/program.sh' ended with exit code 3; its output is in F/out/"))
      << failed;
  EXPECT_TRUE(failed.ends_with("command.log, the last line: no such luck")) << failed;
  write_atomic(folder_ / "luck", "");  // the same program, the same settings
  EXPECT_EQ(failure_of(study), "it did not fail");
}

TEST_F(External, WhatItLeavesMustBeTheFramesPoses) {
  const fs::path study = write_study("\"{out}\"");
  write_program("true\n");
  EXPECT_TRUE(failure_of(study).ends_with("results/trajectory.txt: no such file"))
      << failure_of(study);
  write_program("echo 0.01 0 0 0 0 0 0 1 > \"$1/trajectory.txt\"\n");
  const std::string between = failure_of(study);
  EXPECT_NE(between.find("a pose at 0.01 s, expected the times of frames to within"),
            std::string::npos)
      << between;
  write_program("kill -9 $$\n");
  EXPECT_NE(failure_of(study).find("ended with signal 9"), std::string::npos);
  fs::remove(folder_ / "program.sh");
  EXPECT_EQ(failure_of(study), "'./program.sh' cannot be started: No such file or directory");
}

TEST_F(External, AWrongWordOrNameIsRefusedBeforeAnyWork) {
  write_program("true\n");
  const auto error_of = [&](const fs::path& study) {
    try {
      metrics_of(study);
    } catch (const Error& error) {
      const std::string what = error.what();
      return what.substr(what.find(".yaml") + 5);
    }
    return std::string("no error");
  };
  EXPECT_EQ(error_of(write_study("\"{frame}\"")),
            ":6:18: '{frame}' in the command of 'mine', expected one of: {frames}, {frame_list}, "
            "{calibration}, {out}; did you mean 'frames'?");
  EXPECT_EQ(error_of(write_study("x", "paper")), ":6:11: 'mine' is not among the methods: paper");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace rugae
