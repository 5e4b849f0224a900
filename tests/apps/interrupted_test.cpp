// Ctrl-C, or a disk that takes no more, while frames are rendered and looked at: one line, a
// documented exit code, and the same command goes on from there.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "core/files.h"
#include "tests/apps/child.h"
#include "tests/apps/small_camera.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr int kDone = 0, kBadInput = 2, kStopped = 130;
constexpr std::chrono::seconds kLongest{60};  // until the sign comes

class Interrupted : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    write_small_camera(folder_, 320, 240);
  }
  void TearDown() override { fs::remove_all(folder_); }

  pid_t start(const std::vector<std::string>& words) const {
    return start_program(folder_, words, "error.txt");
  }
  std::string last_line() const {
    std::string text = read_text(folder_ / "error.txt");
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text.substr(text.find_last_of("\n\r") + 1);
  }
  /// What the program ended with after Ctrl-C when the sign had come.
  template <typename Sign>
  int stopped_at(const std::vector<std::string>& words, const Sign& sign) const {
    const pid_t child = start(words);
    const auto end = std::chrono::steady_clock::now() + kLongest;
    while (!(handles_interrupt(child) && sign()) && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    kill(child, SIGINT);
    return wait_for(child);
  }
  int frames_of(const std::string& dataset) const {
    const fs::path frames = folder_ / dataset / "observations" / "frames";
    if (!fs::exists(frames)) return 0;
    int count = 0;
    for (const auto& entry : fs::directory_iterator(frames))
      count += entry.path().extension() == ".png";
    return count;
  }
  std::vector<std::string> simulate(int frames) const {
    return {"simulate", "--resolution",         "coarse",   "--camera", "small.yaml",
            "--first",  std::to_string(frames), "--frames", "1000",     "--out",
            "data"};
  }

  static constexpr const char* kGoesOn =
      "rugae: stopped on request; the same command goes on from here";
  static constexpr const char* kBeginsAnew =
      "rugae: stopped on request; the same command begins anew";
  fs::path folder_ = fs::temp_directory_path() / ("rugae_stopped_" + std::to_string(getpid()));
};

TEST_F(Interrupted, WhileRenderingGoesOnFromThere) {
  constexpr int kFrames = 60;
  EXPECT_EQ(stopped_at(simulate(kFrames), [&] { return frames_of("data") >= 3; }), kStopped);
  EXPECT_EQ(last_line(), kGoesOn);
  const int before = frames_of("data");
  EXPECT_TRUE(before >= 3 && before < kFrames) << before;
  EXPECT_EQ(wait_for(start(simulate(kFrames))), kDone) << last_line();
  EXPECT_EQ(frames_of("data"), kFrames);
}

TEST_F(Interrupted, WhileReconstructing) {
  ASSERT_EQ(wait_for(start(simulate(60))), kDone) << last_line();
  for (const std::string method : {"paper", "dense"}) {
    EXPECT_EQ(stopped_at({"reconstruct", "data", "--method", method, "--out", method},
                         [] { return true; }),
              kStopped)
        << method;
    EXPECT_EQ(last_line(), kBeginsAnew) << method;
    EXPECT_FALSE(fs::exists(folder_ / method / "estimate.json")) << method;
  }
}

// A folder stands where a frame is to be: writing it fails, as on a full disk.
TEST_F(Interrupted, AFrameThatCannotBeWritten) {
  ASSERT_EQ(stopped_at(simulate(200), [&] { return frames_of("data") >= 3; }), kStopped);
  const fs::path later = folder_ / "data" / "observations" / "frames" / "000150.png";
  ASSERT_FALSE(fs::exists(later));
  fs::create_directories(later / "in the way");
  EXPECT_EQ(wait_for(start(simulate(200))), kBadInput);
  EXPECT_NE(last_line().find("000150.png"), std::string::npos) << last_line();
}

}  // namespace
}  // namespace rugae
