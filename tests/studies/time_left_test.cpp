// How long the rest of a study will take.

#include "studies/time_left.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

namespace rugae {
namespace {

const std::filesystem::path kNowhere = "/nowhere";

/// What is known of a cell before it is made: cells that share a dataset or a motion name it alike.
CellJob job_of(const StudyOptions& study, int index, const std::string& dataset,
               const std::string& motion) {
  CellJob job;
  job.study = &study;
  job.index = index;
  job.cell.camera = "misumi-v5506";
  job.files.dataset = job.files.frames = kNowhere / dataset;
  if (!motion.empty()) job.files.motion = kNowhere / motion;
  return job;
}

StudyOptions study_of(Measure measure) {
  StudyOptions study;
  study.measure = measure;
  study.variants.resize(1);
  study.variants[0].simulate.frames = 100;
  return study;
}

constexpr double kElapsed_s = 100.0;

TEST(TimeLeft, EqualCellsTakeEqualTimes) {
  const StudyOptions study = study_of(Measure::loop);
  std::vector<CellJob> jobs;
  for (int i = 0; i < 4; ++i)
    jobs.push_back(job_of(study, i, fmt::format("d{}", i), fmt::format("m{}", i)));
  TimeLeft left(jobs);
  EXPECT_TRUE(std::isinf(left.seconds_left(kElapsed_s)));
  left.made(jobs[2]);
  EXPECT_NEAR(left.seconds_left(kElapsed_s), 3.0 * kElapsed_s, 1e-6);
  left.skipped(jobs[0]);
  EXPECT_NEAR(left.seconds_left(kElapsed_s), 2.0 * kElapsed_s, 1e-6);
}

TEST(TimeLeft, WhatCellsShareIsMadeOnce) {
  const StudyOptions study = study_of(Measure::loop);
  const std::vector<CellJob> jobs = {job_of(study, 0, "d", "m"), job_of(study, 1, "d", "m2"),
                                     job_of(study, 2, "d", "m2")};
  TimeLeft left(jobs);
  left.made(jobs[0]);  // 0.33 + 0.35 + 0.32; then 0.35 + 0.32, then 0.32
  EXPECT_NEAR(left.seconds_left(kElapsed_s), 0.99 * kElapsed_s, 1e-6);
}

// A part that measures one stage must not look like as many whole loops.
TEST(TimeLeft, SingleStagesAreShort) {
  const StudyOptions loop = study_of(Measure::loop), features = study_of(Measure::features);
  std::vector<CellJob> jobs = {job_of(loop, 0, "d", "")};
  for (int i = 1; i < 7; ++i) jobs.push_back(job_of(features, i, "other", ""));
  TimeLeft left(jobs);
  left.made(jobs[0]);
  EXPECT_NEAR(left.seconds_left(kElapsed_s), (0.33 + 6 * 0.05) * kElapsed_s, 1e-6);
}

}  // namespace
}  // namespace rugae
