// Frames one at a time.

#include "recon/reconstruction.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <set>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh.h"
#include "dataset/image_io.h"
#include "recon/pipeline.h"
#include "synthetic.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 24;
constexpr double kStepRad = 0.035;  // about 0.8 mm and 2 degrees between frames
/// Of the path's extent: what neighbours alone tie together, not adjusted to the end.
constexpr double kLiveShare = 0.03;
/// Of the distance from the camera: the map's relief may miss a sparse point by this.
constexpr double kMapShare = 0.03;
/// Of a turn by 0.8 rad, likewise.
constexpr double kLiveTurnRad = 0.02;

class FramesOneAtATime : public testing::TestWithParam<std::string> {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::path(testing::TempDir()) / fmt::format("rugae_live_{}", getpid());
    fs::remove_all(root_);
    for (int i = 0; i < kFrames; ++i) truth_.push_back(synthetic::world_from_camera(i * kStepRad));
    recording_ = synthetic::record(root_ / "recording", lens(), truth_, 1.0);
    for (int i = 0; i < kFrames; ++i)
      pictures_.push_back(read_image_bgr(recording_.images / fmt::format("{:06}.png", i)));
  }
  static void TearDownTestSuite() {
    fs::remove_all(root_);
    truth_.clear();
    pictures_.clear();
  }
  static Lens lens() { return synthetic::lens_of(320, 240); }

  static ReconOptions options() {
    ReconOptions options;
    options.method = GetParam();
    options.pictures = false;
    return options;
  }
  fs::path fresh(const std::string& name) const {
    fs::remove_all(root_ / name);
    return root_ / name;
  }

  static fs::path root_;
  static synthetic::Recording recording_;
  static std::vector<Rigid3> truth_;
  static std::vector<cv::Mat> pictures_;
};
fs::path FramesOneAtATime::root_;
synthetic::Recording FramesOneAtATime::recording_;
std::vector<Rigid3> FramesOneAtATime::truth_;
std::vector<cv::Mat> FramesOneAtATime::pictures_;

std::string message_of_add(Reconstruction& reconstruction, const cv::Mat& picture, double time_s) {
  try {
    reconstruction.add(picture, time_s);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

// Each pose is there when its frame is, near to the truth; whoever asks changes nothing of the end.
TEST_P(FramesOneAtATime, PosesWhileTheyCome) {
  const fs::path asked = fresh("asked"), silent = fresh("silent");
  Reconstruction live(asked, {lens(), {}, {}}, options()),
      other(silent, {lens(), {}, {}}, options());
  std::vector<Rigid3> poses, truth;
  TriangleMesh half;
  for (int i = 0; i < kFrames; ++i) {
    live.add(pictures_[static_cast<std::size_t>(i)], i / 30.0);
    other.add(pictures_[static_cast<std::size_t>(i)], i / 30.0);
    if (const auto pose = live.pose()) {
      poses.push_back(*pose);
      truth.push_back(truth_[static_cast<std::size_t>(i)]);
    }
    if (i == 2 * kFrames / 3) half = live.map();
  }
  EXPECT_EQ(live.size(), kFrames);
  ASSERT_GE(poses.size(), static_cast<std::size_t>(3 * kFrames / 4));
  const synthetic::PathError error = synthetic::path_error(poses, truth);
  std::printf("%zu of %d poses, %.3f mm of %.1f mm, map of %zu triangles\n", poses.size(), kFrames,
              error.rmse, error.path_extent, half.triangles.size());
  EXPECT_TRUE(error.rmse <= kLiveShare * error.path_extent);
  EXPECT_TRUE(error.worst_rotation_rad <= kLiveTurnRad) << error.worst_rotation_rad;
  EXPECT_FALSE(half.empty());

  Progress progress(Progress::Output::silent);
  const Estimate a = live.finish(root_ / "asked_estimate", progress);
  const Estimate b = other.finish(root_ / "silent_estimate", progress);
  EXPECT_EQ(a.track().size(), static_cast<std::size_t>(kFrames));
  for (const char* file : {"trajectory.txt", "points.ply", "map.ply"})
    EXPECT_EQ(sha256_of_file(root_ / "asked_estimate" / file),
              sha256_of_file(root_ / "silent_estimate" / file))
        << file;
  EXPECT_THROW(live.pose(), Error);
  EXPECT_THROW(live.add(pictures_[0], 9.0), Error);
  EXPECT_THROW(live.finish(root_ / "again", progress), Error);

  // What was recorded is as good as any folder.
  const Observations recorded = Observations::open(asked);
  EXPECT_EQ(recorded.size(), kFrames);
  EXPECT_EQ(recorded.time_s(7), 7 / 30.0);
  const Estimate later = reconstruct(recorded, options(), root_ / "later", progress);
  std::set<std::string> stages;  // each once: their times add up to all that it took
  for (const StageTime& stage : later.stages) {
    EXPECT_TRUE(stages.insert(stage.name).second || stage.name == "bundle adjustment" ||
                stage.name == "revisits")
        << stage.name;
  }
  EXPECT_TRUE(stages.contains("key frames") && stages.contains("pairwise alignment"));
  EXPECT_FALSE(stages.contains("frames"));
  std::vector<Rigid3> now, then;
  for (int i = 0; i < kFrames; ++i) {
    now.push_back(a.world_from_camera[static_cast<std::size_t>(i)]);
    then.push_back(later.world_from_camera[static_cast<std::size_t>(i)]);
  }
  EXPECT_TRUE(synthetic::path_error(now, truth_).rmse <= kLiveShare * error.path_extent);
  EXPECT_TRUE(synthetic::path_error(then, truth_).rmse <= kLiveShare * error.path_extent);
}

// Who looks on sees every key frame once, each stage from none to all of its steps, and the
// pictures that are written.
TEST_P(FramesOneAtATime, AListenerSeesProgressAndPictures) {
  struct Seen : Listener {
    void progress(const std::string& stage, std::size_t done, std::size_t total) override {
      if (stages.empty() || stages.back() != stage) stages.push_back(stage);
      EXPECT_TRUE(total == 0 || done <= total) << stage << done << " " << total;
    }
    void picture(const std::string& name, const cv::Mat& image) override {
      EXPECT_EQ(image.depth(), CV_8U);
      EXPECT_FALSE(image.empty());
      EXPECT_TRUE(names.insert(name).second) << name;
    }
    std::vector<std::string> stages;
    std::set<std::string> names;
  } seen;
  ReconOptions with_pictures = options();
  with_pictures.pictures = true;
  Reconstruction live(Observations::open(recording_.images, recording_.calibration), with_pictures);
  live.listen(&seen);
  while (live.size() < kFrames) live.add();
  EXPECT_TRUE(seen.names.contains("followed/000000.png"));
  EXPECT_GT(seen.names.size(), 3u);
  const fs::path out = fresh("listened");
  Progress progress(Progress::Output::silent);
  live.finish(out, progress);
  EXPECT_EQ(seen.stages.front(), "structure");
  EXPECT_EQ(seen.stages.back(), "pictures");
  std::size_t written = 0;
  for (const auto& entry : fs::recursive_directory_iterator(out / "pictures")) {
    if (!entry.is_regular_file()) continue;
    ++written;
    EXPECT_TRUE(seen.names.contains(fs::relative(entry.path(), out / "pictures").string()))
        << entry.path();
  }
  EXPECT_GT(written, 20u);
  const auto followed = std::ranges::count_if(
      seen.names, [](const std::string& name) { return name.starts_with("followed/"); });
  EXPECT_EQ(seen.names.size(), written + static_cast<std::size_t>(followed));
}

// The map of half the frames lies in the world of the poses.
TEST_P(FramesOneAtATime, TheMapIsInTheWorldOfThePoses) {
  Reconstruction live(Observations::open(recording_.images, recording_.calibration), options());
  while (live.size() < kFrames) live.add();
  const auto pose = live.pose();
  ASSERT_TRUE(pose);
  const TriangleMesh map = live.map();
  ASSERT_FALSE(map.empty());
  const Structure& sparse = live.structure();
  const ClosestPoint wall(map);
  std::vector<double> off;
  for (const Track& track : sparse.tracks) {
    if (!track.triangulated) continue;
    const double depth = (pose->inverse() * track.point).norm();
    off.push_back(wall(track.point).distance_mm / depth);
  }
  ASSERT_GT(off.size(), 100u);
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::ranges::nth_element(off, middle);
  EXPECT_TRUE(*middle <= kMapShare) << *middle;
}

TEST_P(FramesOneAtATime, WhatCannotBeAddedIsNamed) {
  const fs::path folder = fresh("errors");
  Reconstruction live(folder, {lens(), {}, {}}, options());
  EXPECT_FALSE(live.pose());
  EXPECT_TRUE(live.map().empty());
  live.add(pictures_[0], 1.0);
  EXPECT_EQ(message_of_add(live, pictures_[1], 1.0),
            folder.string() + ": frame 1 is at 1 s, expected after 1 s");
  EXPECT_EQ(
      message_of_add(live, cv::Mat(10, 20, CV_8UC3), 2.0),
      folder.string() + ": frame 1 is 20 x 10 px of type 16, expected 320 x 240 px, 8-bit BGR");
  EXPECT_THROW(live.add(), Error);
  EXPECT_EQ(live.size(), 1);
  Progress progress(Progress::Output::silent);
  EXPECT_THROW(live.finish(root_ / "one", progress), Error);
  EXPECT_THROW(Reconstruction(folder, {lens(), {}, {}}, options()), Error);  // has frames already

  Reconstruction recorded(Observations::open(recording_.images, recording_.calibration), options());
  EXPECT_NE(message_of_add(recorded, pictures_[0], 0.0).find("recorded"), std::string::npos);
  while (recorded.size() < kFrames) recorded.add();
  EXPECT_THROW(recorded.add(), Error);
}

INSTANTIATE_TEST_SUITE_P(Methods, FramesOneAtATime, testing::Values("paper", "dense"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace rugae
