// A study that is killed, at any moment and as often as one likes, ends with the same results.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "core/files.h"
#include "core/random.h"
#include "tests/apps/child.h"
#include "tests/apps/small_camera.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr int kKills = 20;
constexpr int kLongestMs = 1500;  // of a run that is killed: several would finish the study

class StudyKilled : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    write_small_camera(folder_, 160, 120);
    write_atomic(folder_ / "short.yaml", "like: \"1\"\nlength_cm: 4\npasses: 1\n");
    write_atomic(folder_ / "study.yaml",
                 "title: Killed\nresolution: coarse\nframes: 8\ncameras: [small.yaml]\n"
                 "trajectories: [short.yaml]\nseeds: [1, 2]\n"
                 "details: false\nrecon: {pictures: false}\n"  // no pictures of what is compared
                 "axes: {recon.shading.iterations: [3, 5]}\n"
                 "tables: [{title: T, metric: trajectory.ate_sim3_rmse_mm, rows: seed}]\n"
                 "gates: [{metric: tracking.tracked_share, above: 0.5, reason: most of them}]\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  pid_t start(const std::string& out, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"run", "study.yaml", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    return start_program(folder_, words);
  }

  fs::path folder_ = fs::temp_directory_path() / ("rugae_killed_" + std::to_string(getpid()));
};

// The program alone is killed, not what it started: its cells must not go on without it. One by
// one, side by side, and where the budget holds no second cell: cells that share a dataset and a
// motion never make the same one.
TEST_F(StudyKilled, AtTwentyRandomMomentsGivesTheSameResults) {
  ASSERT_EQ(wait_for(start("whole", {"--jobs", "1"})), 0);
  const std::string expected = read_text(folder_ / "whole" / "results.json");
  EXPECT_NE(expected.find("\"passed\": true"), std::string::npos);

  int kills = 0, finished = 0;
  for (std::uint64_t attempt = 0; kills < kKills; ++attempt) {
    const pid_t child = start("out", {"--jobs", "2"});
    const double share = random_uniform(1, Purpose::test, 0, attempt)[0];
    const auto delay = static_cast<int>(kLongestMs * share);
    std::this_thread::sleep_for(milliseconds(delay));
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) {  // done before it could be killed
      ASSERT_EQ(WEXITSTATUS(status), 0);
      EXPECT_EQ(read_text(folder_ / "out" / "results.json"), expected);
      fs::remove_all(folder_ / "out");
      ++finished;
      continue;
    }
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    ++kills;
  }
  ASSERT_EQ(wait_for(start("out", {"--jobs", "2"})), 0);
  EXPECT_EQ(read_text(folder_ / "out" / "results.json"), expected);
  RecordProperty("finished_between", finished);

  ASSERT_EQ(wait_for(start("poor", {"--jobs", "4", "--memory-gb", "0.01"})), 0);
  for (const char* file :
       {"results.json", "table.csv", "repeats.csv", "tables/1.csv", "junit.xml"}) {
    EXPECT_EQ(read_text(folder_ / "whole" / file), read_text(folder_ / "out" / file)) << file;
    EXPECT_EQ(read_text(folder_ / "whole" / file), read_text(folder_ / "poor" / file)) << file;
  }
}

}  // namespace
}  // namespace rugae
