#include "studies/discard.h"

#include "core/files.h"
#include "dataset/layout.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/small_set.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

// Cells whose parts are files with a word in them; datasets are whole.
class Discard : public InTemporaryFolder {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    results_.keep = Keep::results;
  }

  CellJob job(const StudyOptions& study, const std::string& name, const std::string& dataset) {
    CellJob job{&study, {}, {}, 0};
    job.files.dataset = job.files.frames = folder_ / dataset;
    job.files.estimate = folder_ / (name + "_estimate");
    job.files.motion = folder_ / (dataset + "_motion");
    job.files.metrics = folder_ / (name + ".json");
    job.files.frames_kept = study.keep == Keep::all;
    if (!fs::exists(job.files.dataset)) {
      test::SmallSet set(16, 12, 10.0);
      set.grays.assign(3, cv::Mat(12, 16, CV_8U, cv::Scalar(9)));
      set.write(job.files.dataset);
      write_atomic(simulation_of(job.files.dataset), "{}");
    }
    make_folder(job.files.estimate);
    write_atomic(job.files.estimate / "map.ply", "map");
    write_atomic(job.files.motion, "motion");
    return job;
  }

  static void finish(const CellJob& job, const std::string& metrics = "{}") {
    write_atomic(job.files.metrics, metrics);
  }
  static bool kept(const CellJob& job) {
    return dataset_finished(job.files.dataset) && fs::exists(job.files.motion);
  }

  StudyOptions all_, results_;
};

TEST_F(Discard, WaitsForEveryCellThatNeedsThePart) {
  const std::vector<CellJob> jobs = {job(results_, "head", "first"), job(results_, "a", "shared"),
                                     job(results_, "b", "shared")};
  finish(jobs[0]);
  finish(jobs[1]);
  discard_finished(jobs);
  EXPECT_TRUE(kept(jobs[1]));
  EXPECT_FALSE(fs::exists(jobs[1].files.estimate));  // its own
  EXPECT_TRUE(fs::exists(jobs[2].files.estimate));

  finish(jobs[2], R"({"failed": "no memory", "try_again": true})");
  discard_finished(jobs);
  EXPECT_TRUE(kept(jobs[2]));  // it will be tried again

  finish(jobs[2], R"({"failed": "no texture"})");
  discard_finished(jobs);
  EXPECT_FALSE(fs::exists(jobs[2].files.motion));
  EXPECT_FALSE(fs::exists(DatasetLayout{jobs[2].files.dataset}.manifest()));
  EXPECT_TRUE(fs::exists(DatasetLayout{jobs[2].files.dataset}.frame(1)));
  EXPECT_FALSE(fs::exists(DatasetLayout{jobs[2].files.dataset}.frame(0)));
  EXPECT_TRUE(kept(jobs[0]));
  EXPECT_TRUE(fs::exists(jobs[0].files.estimate));
}

TEST_F(Discard, LeavesWhatAnotherPartKeeps) {
  const std::vector<CellJob> jobs = {job(all_, "head", "first"), job(results_, "a", "shared"),
                                     job(all_, "b", "shared"), job(results_, "c", "own")};
  for (const CellJob& each : jobs) finish(each);
  discard_finished(jobs);
  EXPECT_TRUE(kept(jobs[1]));
  EXPECT_FALSE(fs::exists(jobs[1].files.estimate));
  EXPECT_TRUE(fs::exists(jobs[2].files.estimate));
  EXPECT_FALSE(kept(jobs[3]));
  for (const CellJob& each : jobs) EXPECT_TRUE(each.files.finished());
}

// Frames that replaced those of the dataset go as the dataset does.
TEST_F(Discard, ReplacedFramesAreADatasetAsWell) {
  std::vector<CellJob> jobs = {job(results_, "head", "first"), job(results_, "a", "truth"),
                               job(results_, "b", "clean")};
  jobs[1].files.frames = jobs[2].files.dataset;
  finish(jobs[0]);
  finish(jobs[2]);
  discard_finished(jobs);
  EXPECT_TRUE(dataset_finished(jobs[1].files.frames));
  finish(jobs[1]);
  discard_finished(jobs);
  EXPECT_FALSE(dataset_finished(jobs[1].files.frames));
  EXPECT_FALSE(dataset_finished(jobs[1].files.dataset));
}

}  // namespace
}  // namespace rugae
