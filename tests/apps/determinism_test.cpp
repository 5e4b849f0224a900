// The same command gives the same bytes, however the program was interrupted.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/files.h"
#include "core/random.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

class Determinism : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "tiny.yaml")
        << "lens: {width: 160, height: 120, horizontal_fov_deg: 100, k1: -0.05}\n"
           "sensor: {pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, "
           "read_noise_e: 10}\n";
  }
  void TearDown() override { fs::remove_all(folder_); }

  // The program on its way; its output is of no interest here.
  pid_t start(const std::string& out) const {
    std::vector<std::string> words = {RUGAE_PROGRAM, "simulate",  "--resolution", "coarse",
                                      "--camera",    "tiny.yaml", "--trajectory", "1",
                                      "--frames",    "120",       "--out",        out};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string folder = folder_.string();
    const pid_t process = fork();
    if (process == 0) {
      const int nowhere = open("/dev/null", O_WRONLY);
      if (chdir(folder.c_str()) != 0 || dup2(nowhere, 1) < 0 || dup2(nowhere, 2) < 0) _exit(126);
      execv(RUGAE_PROGRAM, arguments.data());
      _exit(127);
    }
    return process;
  }
  // True when it ended by itself and said that all is done.
  static bool finish(pid_t process) {
    int status = 0;
    waitpid(process, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  int frames_written(const std::string& out) const {
    const fs::path frames = folder_ / out / "observations" / "frames";
    if (!fs::exists(frames)) return 0;
    return static_cast<int>(std::distance(fs::directory_iterator(frames), {}));
  }

  fs::path folder_ = fs::temp_directory_path() /
                     ("rugae_determinism_" + std::to_string(static_cast<long>(getpid())));
};

// Moments are counted in frames on disk, not in seconds: another load on the machine would have all
// of them fall before the first frame or after the last.
TEST_F(Determinism, KilledAtTenRandomMomentsAndResumed) {
  ASSERT_TRUE(finish(start("whole")));
  constexpr int kKills = 10;
  constexpr double kMostFrames = 12.0, kMostDelay_s = 0.1;
  constexpr std::chrono::seconds kPatience{120};
  int killed_between_frames = 0;
  for (int kill_number = 0; kill_number < kKills; ++kill_number) {
    const auto u = random_uniform(1, Purpose::test, 7, static_cast<std::uint64_t>(kill_number));
    // none more: while the scene is made
    const int wanted = frames_written("killed") + static_cast<int>(u[0] * kMostFrames);
    const Clock::time_point begin = Clock::now();
    const pid_t process = start("killed");
    while (frames_written("killed") < wanted && Clock::now() - begin < kPatience)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::duration<double>(u[1] * kMostDelay_s));
    kill(process, SIGKILL);
    finish(process);
    ASSERT_GE(frames_written("killed"), wanted);
    killed_between_frames +=
        frames_written("killed") > 0 && !fs::exists(folder_ / "killed" / "manifest.sha256");
  }
  EXPECT_GE(killed_between_frames, kKills / 2);  // or the test shows little
  ASSERT_TRUE(finish(start("killed")));
  const auto files = [&](const char* out) {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / out))
      names.insert(entry.path().lexically_relative(folder_ / out).string());
    return names;
  };
  EXPECT_EQ(files("killed"), files("whole"));  // no temporary file is left behind
  EXPECT_EQ(read_text(folder_ / "killed" / "manifest.sha256"),
            read_text(folder_ / "whole" / "manifest.sha256"));
}

}  // namespace
}  // namespace rugae
