// Which cells run side by side. The program that makes them is a script that says when it starts
// and ends.

#include "studies/run_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "core/check.h"
#include "core/files.h"
#include "tests/studies/in_temporary_folder.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr int kJobs = 2;
constexpr double kMuchGb = 100.0;

class RunCells : public InTemporaryFolder {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    alone_.alone = true;
    // Time for another cell to start, if one will.
    script("for i in 1 2 3 4 5 6 7 8 9 10; do [ $(grep -c start " + (folder_ / "said").string() +
           ") -lt 2 ] && sleep 0.2; done; sleep 0.1");
  }

  // `work` stands for what makes cell $cell with its metrics.
  void script(const std::string& work) {
    const fs::path program = folder_ / "program.sh";
    write_atomic(program, fmt::format(R"(#!/bin/sh
cell=$6
echo "start $cell ${{10}}" >> {0}/said
{1}
echo "{{}}" > {0}/$cell.json
echo "end $cell" >> {0}/said
)",
                                      folder_.string(), work));
    fs::permissions(program, fs::perms::owner_all);
    options_.jobs = kJobs;
    options_.memory_gb = kMuchGb;
    options_.program = program;
  }

  void add(const StudyOptions& study, const std::string& dataset) {
    CellJob job{&study, {}, {}, static_cast<int>(jobs_.size())};
    job.cell.camera = "misumi-v5506";
    job.files.dataset = job.files.frames = folder_ / dataset;
    job.files.metrics = folder_ / fmt::format("{}.json", job.index);
    job.files.frames_kept = false;
    jobs_.push_back(job);
  }

  void run() {
    Progress quiet(Progress::Output::silent);
    run_cells(jobs_, folder_ / "study.yaml", folder_, options_, quiet);
    std::istringstream said(read_text(folder_ / "said"));
    for (std::string line; std::getline(said, line);) said_.push_back(line);
  }

  // Between the start and the end of the cell, nothing of others.
  bool had_all(int cell) const {
    const auto is_start = [&](const std::string& line) {
      return line.starts_with(fmt::format("start {} ", cell));
    };
    const auto start = std::ranges::find_if(said_, is_start);
    return start != said_.end() && std::next(start) != said_.end() &&
           *std::next(start) == fmt::format("end {}", cell);
  }

  // Either of the first two may be first to say so.
  bool began_together() const {
    return said_.at(0).starts_with("start") && said_.at(1).starts_with("start");
  }

  StudyOptions together_, alone_;
  RunOptions options_;
  std::vector<CellJob> jobs_;
  std::vector<std::string> said_;
};

TEST_F(RunCells, SideBySide) {
  add(together_, "a");
  add(together_, "b");
  run();
  EXPECT_TRUE(began_together());
}

TEST_F(RunCells, WaitForTheFirstThatMakesWhatTheyShare) {
  add(together_, "a");
  add(together_, "a");
  run();
  EXPECT_TRUE(had_all(0));
  EXPECT_TRUE(had_all(1));
}

TEST_F(RunCells, ThoseThatAreTimedHaveTheMachineToThemselves) {
  for (const std::string dataset : {"a", "b"}) add(together_, dataset);
  for (const std::string dataset : {"c", "d"}) add(alone_, dataset);
  for (const std::string dataset : {"e", "f"}) add(together_, dataset);
  run();
  EXPECT_TRUE(had_all(2));
  EXPECT_TRUE(had_all(3));
  EXPECT_TRUE(began_together());
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  EXPECT_EQ(std::ranges::count(said_, fmt::format("start 2 {}", cores)), 1);
  EXPECT_EQ(std::ranges::count(said_, fmt::format("start 0 {}", std::max(1u, cores / kJobs))), 1);
}

TEST_F(RunCells, NoMoreThanFitIntoTheMemory) {
  add(together_, "a");
  add(together_, "b");
  options_.memory_gb = 1.9 * memory_gb_of(jobs_[0]);
  run();
  EXPECT_TRUE(had_all(0));
  EXPECT_TRUE(had_all(1));
}

TEST_F(RunCells, FramesThatAreHeldNeedMemoryUpToABound) {
  add(together_, "a");
  const auto of_frames = [&](int frames, int first) {
    together_.variants[0].simulate.frames = frames;
    together_.variants[0].simulate.first = first;
    return memory_gb_of(jobs_[0]);
  };
  constexpr double kGray_gb = 640.0 * 480.0 / 1e9, kRounding_gb = 1e-12;
  constexpr double kHeld = 1.125;  // gray, and a bit a pixel of reflections
  EXPECT_NEAR(of_frames(200, 0) - of_frames(100, 0), 100 * kHeld * kGray_gb, kRounding_gb);
  EXPECT_EQ(of_frames(200, 100), of_frames(100, 0));
  EXPECT_EQ(of_frames(0, 0), of_frames(720, 0));  // as many as in the paper
  EXPECT_EQ(of_frames(100'000, 0), of_frames(5'000, 0));
}

TEST_F(RunCells, OneThatIsKilledFailsAndTheRestGoesOn) {
  script("[ $cell != 0 ] || kill -9 $$");
  add(together_, "a");
  add(together_, "b");
  run();
  EXPECT_NE(read_text(folder_ / "0.json").find("signal 9"), std::string::npos)
      << read_text(folder_ / "0.json");
  EXPECT_EQ(read_text(folder_ / "1.json"), "{}\n");
}

}  // namespace
}  // namespace rugae
