// Runs that were killed go on and end with the same bytes.

#include <csignal>
#include <thread>

#include "dataset/frame_list.h"
#include "dataset/layout.h"
#include "tests/message_of.h"
#include "tests/render/simulate_fixture.h"

namespace rugae {
namespace {

TEST_F(Simulate, AKilledRunGoesOn) {
  run("whole");
  // As after a kill: three frames are there, a fourth was begun.
  run("killed");
  const DatasetLayout layout{root_ / "killed"};
  fs::remove(layout.manifest());
  fs::remove(layout.frame_list());
  for (int i = 3; i < 7; ++i) fs::remove(layout.frame(i));
  const SimulateResult result = run("killed");
  EXPECT_EQ(result.frames + result.skipped, 7);
  EXPECT_GE(result.frames, 4);
  expect_same("whole", "killed");

  const SimulateResult nothing_left = run("killed");
  EXPECT_EQ(nothing_left.frames, 0);
  EXPECT_EQ(nothing_left.skipped, 7);
  expect_same("whole", "killed");
}

// Noise does not move the path: nothing else on disk would differ.
TEST_F(Simulate, ATrajectoryOfOtherNoiseIsAnotherDataset) {
  write_atomic(root_ / "path.yaml", "file: track.txt\nclearance_mm: 5\nread_noise_factor: 5\n");
  run("noisy");
  fs::remove(DatasetLayout{root_ / "noisy"}.manifest());
  write_atomic(root_ / "path.yaml", "file: track.txt\nclearance_mm: 5\n");
  EXPECT_NE(message_of([&] { run("noisy"); }).find("holds another dataset"), std::string::npos);
}

TEST_F(Simulate, LostTrackPointsAreWrittenAgain) {
  options_.render.truth.tracks = 50;
  run("tracked");
  const fs::path points = DatasetLayout{root_ / "tracked"}.track_points();
  const std::string bytes = read_text(points);
  fs::remove(points);
  EXPECT_EQ(run("tracked").frames, 0);
  EXPECT_EQ(read_text(points), bytes);
}

TEST_F(Simulate, APlannedPathKeepsLightsOutOfTheWall) {
  std::string camera = read_text(options_.camera);
  write_atomic(options_.camera, camera + "lights: [{offset_mm: [12, 0, 0]}]\n");
  options_.scene = "stomach";
  options_.trajectory = "1";  // 10.9 mm from the wall without the light
  options_.frames = 2;
  EXPECT_GE(run("lit").min_clearance_mm, 12.5);
}

TEST_F(Simulate, PatternsThatACameraHasNotAreRefused) {
  options_.render.sensor.dsnu = true;
  EXPECT_EQ(message_of([&] { run("patterned"); }),
            "camera 'small' has no dsnu_e, which sensor.dsnu needs");
}

class Resume : public Simulate {
 protected:
  // For a process of its own: it ends for good as soon as the frame is on disk.
  void run_until_killed_at(int frame) {
    const fs::path started = DatasetLayout{root_ / "killed"}.frame(frame);
    std::jthread killer([started] {
      while (!fs::exists(started)) std::this_thread::yield();
      kill(getpid(), SIGKILL);
    });
    run("killed");
    // Too late: never reached unless sixty frames are written faster than one is noticed.
    _exit(0);
  }
};

TEST_F(Resume, AProcessKilledInTheMiddleGoesOn) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  options_.frames = 60;
  EXPECT_EXIT(run_until_killed_at(4), testing::KilledBySignal(SIGKILL), "");
  EXPECT_FALSE(fs::exists(DatasetLayout{root_ / "killed"}.manifest()));
  const SimulateResult result = run("killed");
  EXPECT_GT(result.skipped, 0);
  EXPECT_GT(result.frames, 0);
  run("whole");
  expect_same("whole", "killed");
}

// Exposure that follows earlier frames: the same for any threads, after a kill, and alone.
TEST_F(Simulate, AutomaticExposureHasTheSameBytesHoweverItIsRun) {
  options_.render.sensor.exposure = ExposureMode::automatic;
  options_.render.sensor.delay_frames = 1;
  options_.frames = 12;
  options_.threads = 1;
  run("whole");
  options_.threads = 2;
  run("two");
  expect_same("whole", "two");
  const DatasetLayout whole{root_ / "whole"};
  const auto list = read_frame_list(whole.frame_list());
  options_.render.sensor.exposure = ExposureMode::per_frame;
  run("memoryless");
  const auto metered = read_frame_list(DatasetLayout{root_ / "memoryless"}.frame_list());
  const auto total = [](const FrameRecord& record) { return record.exposure_s * record.gain; };
  for (std::size_t i = 1; i < list.size(); ++i) {
    const double expected = std::sqrt(total(list[i - 1]) * total(metered[i - 1]));
    EXPECT_TRUE(std::abs(total(list[i]) / expected - 1.0) <= 1e-6) << i;
    EXPECT_NE(total(list[i]), total(metered[i])) << i;
  }

  options_.render.sensor.exposure = ExposureMode::automatic;
  options_.only_frame = 7;
  EXPECT_EQ(run("alone").frames, 1);
  const DatasetLayout alone{root_ / "alone"};
  EXPECT_EQ(read_text(whole.frame(7)), read_text(alone.frame(7)));
  EXPECT_FALSE(fs::exists(alone.frame(6)));
}

TEST_F(Resume, AutomaticExposureGoesOnAfterAKill) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  options_.render.sensor.exposure = ExposureMode::automatic;
  options_.frames = 60;
  EXPECT_EXIT(run_until_killed_at(9), testing::KilledBySignal(SIGKILL), "");
  const DatasetLayout killed{root_ / "killed"};
  // also frames behind which others are there
  for (int i : {2, 5}) fs::remove(killed.frame(i));
  const SimulateResult result = run("killed");
  EXPECT_GT(result.skipped, 0);
  EXPECT_GT(result.frames, 0);
  run("whole");
  expect_same("whole", "killed");
}

}  // namespace
}  // namespace rugae
