// The whole pipeline on plain pictures of a cavity: a folder of images and a calibration file, as a
// user would have them.

#include "recon/pipeline.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <set>

#include "core/check.h"
#include "core/files.h"
#include "dataset/image_io.h"
#include "recon/frame_follower.h"
#include "synthetic.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 14;
constexpr double kStepRad = 0.035;  // about 0.8 mm and 2 degrees between frames

class Pipeline : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::path(testing::TempDir()) / fmt::format("rugae_pipeline_{}", getpid());
    fs::remove_all(root_);
    std::vector<Rigid3> path;
    for (int i = 0; i < kFrames; ++i) path.push_back(synthetic::world_from_camera(i * kStepRad));
    recording_ = synthetic::record(root_ / "recording", synthetic::lens_of(320, 240), path, 1.0);
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  static Estimate run(const synthetic::Recording& recording, const std::string& name,
                      ReconOptions options = {}) {
    options.keyframes.mean_flow_px = 15.0;
    options.pictures = false;
    Progress progress(Progress::Output::silent);
    return reconstruct(Observations::open(recording.images, recording.calibration), options,
                       root_ / name, progress);
  }

  static fs::path root_;
  static synthetic::Recording recording_;
};

fs::path Pipeline::root_;
synthetic::Recording Pipeline::recording_;

// Half a degree and 2 % of the path: what 320 x 240 pictures without any tuning must give.
constexpr double kPathShare = 0.02;
constexpr double kRotationRad = 0.009;

TEST_F(Pipeline, FindsThePathFromPicturesAndTheBytesDoNotDependOnThreads) {
  Estimate two;
  {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 2);
    cv::setNumThreads(2);
    ReconOptions options;
    options.pictures = true;
    two = run(recording_, "two", options);
  }
  std::vector<Rigid3> estimated, truth;
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_NE(two.states[i], FrameState::lost) << i;
    if (two.states[i] == FrameState::lost) continue;
    estimated.push_back(two.world_from_camera[i]);
    truth.push_back(recording_.world_from_camera[i]);
  }
  const auto error = synthetic::path_error(estimated, truth);
  EXPECT_TRUE(error.rmse <= kPathShare * error.path_extent) << error.rmse;
  EXPECT_TRUE(error.worst_rotation_rad <= kRotationRad) << error.worst_rotation_rad;
  EXPECT_FALSE(two.map.empty());

  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
  cv::setNumThreads(1);
  run(recording_, "one");
  cv::setNumThreads(-1);
  for (const char* file : {"trajectory.txt", "frames.csv", "points.ply", "map.ply"})
    EXPECT_EQ(read_text(root_ / "one" / file), read_text(root_ / "two" / file)) << file;
}

// A motion read back from disk makes the same map, to the byte; one with another depth stage,
// another.
TEST_F(Pipeline, TheMapIsMadeFromAMotionOnDisk) {
  ReconOptions options;
  options.keyframes.mean_flow_px = 15.0;
  options.pictures = true;
  Progress progress(Progress::Output::silent);
  const Observations observations = Observations::open(recording_.images, recording_.calibration);
  const fs::path whole = root_ / "whole", halves = root_ / "halves";
  const Estimate at_once = reconstruct(observations, options, whole, progress);

  const FrameSource frames(observations, options.preprocess);
  write_motion(root_ / "motion.cbor", estimate_motion(frames, options, Stages(), progress));
  const Motion motion = read_motion(root_ / "motion.cbor");
  const cv::Mat held = frames.gray(0);
  const Estimate in_halves = build_map(frames, motion, options, halves, Stages(), progress);
  EXPECT_NE(frames.gray(0).data, held.data);  // forgotten before the map, which needs the memory
  for (const char* file : {"trajectory.txt", "frames.csv", "points.ply", "map.ply"})
    EXPECT_EQ(read_text(whole / file), read_text(halves / file)) << file;
  EXPECT_EQ(at_once.numbers, in_halves.numbers);
  const auto shown = std::ranges::find_if(
      motion.pairs, [](const PairAlignment& pair) { return !pair.reference_px.empty(); });
  ASSERT_NE(shown, motion.pairs.end());
  const std::string pair = fmt::format("{:06}-{:06}.png", shown->reference, shown->moving);
  EXPECT_EQ(read_text(whole / "pictures" / "inliers" / pair),
            read_text(halves / "pictures" / "inliers" / pair));
  EXPECT_EQ(in_halves.stages.front().name, motion.stages.front().name);
  EXPECT_EQ(in_halves.stages.back().name, "pictures");
  double motion_s = 0.0;
  for (const StageTime& stage : motion.stages) motion_s += stage.seconds;
  EXPECT_EQ(in_halves.path_s, motion_s);

  EXPECT_FALSE(motion.structure.scale_sigma_share.has_value());
  Motion in_mm = motion;
  in_mm.structure.scale_sigma_share = 0.0123;
  write_motion(root_ / "in_mm.cbor", in_mm);
  EXPECT_EQ(read_motion(root_ / "in_mm.cbor").structure.scale_sigma_share, 0.0123);

  // Into a folder with another estimate: nothing of that one is left.
  ReconOptions fewer = options;
  fewer.keyframes.mean_flow_px = 40.0;
  reconstruct(observations, fewer, root_ / "again", progress);
  write_atomic(EstimateLayout{root_ / "again"}.depth(kFrames + 1), "");
  build_map(frames, motion, options, root_ / "again", Stages(), progress);
  const auto files_in = [&](const fs::path& folder) {
    std::set<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      files.insert(fs::relative(entry.path(), folder).string());
    return files;
  };
  EXPECT_EQ(files_in(root_ / "again"), files_in(halves));

  Stages blind;
  blind.depth = [](const Mosaic&, const Structure&, const Lens&, const ReconOptions&) {
    return std::optional<MosaicDepth>();
  };
  EXPECT_TRUE(build_map(frames, motion, options, root_ / "blind", blind, progress).map.empty());

  write_atomic(root_ / "cut.cbor", read_text(root_ / "motion.cbor").substr(0, 5000));
  write_atomic(root_ / "other.cbor", R"({"format": "another"})");
  for (const char* file : {"cut.cbor", "other.cbor"}) {
    try {
      read_motion(root_ / file);
      ADD_FAILURE() << "expected an Error: " << file;
    } catch (const Error& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with((root_ / file).string() + ": "))
          << error.what();
    }
  }
}

// Of many pairs every n-th has its correspondences, however many pairs there are.
TEST_F(Pipeline, FewPairsKeepTheirCorrespondences) {
  ReconOptions options;
  options.keyframes.mean_flow_px = 2.0;
  Progress progress(Progress::Output::silent);
  const FrameSource frames(Observations::open(recording_.images, recording_.calibration),
                           options.preprocess);
  const Followed followed = follow_frames(frames, options, progress);
  std::vector<std::size_t> with;
  for (std::size_t i = 0; i < followed.pairs.size(); ++i)
    if (!followed.pairs[i].reference_px.empty()) with.push_back(i);
  std::printf("%zu pairs, %zu with correspondences\n", followed.pairs.size(), with.size());
  ASSERT_GT(followed.pairs.size(), 24u);
  EXPECT_TRUE(with.size() >= 12 && with.size() <= 24) << with.size();
  for (std::size_t i = 0; i < with.size(); ++i) EXPECT_EQ(with[i], i * with[1]);
}

TEST_F(Pipeline, FramesWithoutTextureAreLostNotErrors) {
  const fs::path folder = root_ / "blank_between";
  fs::copy(recording_.images.parent_path(), folder, fs::copy_options::recursive);
  synthetic::Recording recording = recording_;
  recording.images = folder / "images";
  const cv::Mat blank(240, 320, CV_8UC3, cv::Scalar(90, 95, 120));
  write_image(recording.images / "000005.png", blank);
  write_image(recording.images / "000010.png", blank);
  const Estimate e = run(recording, "blank_between_out");
  EXPECT_EQ(e.states[5], FrameState::lost);
  EXPECT_EQ(e.states[10], FrameState::lost);
  int tracked = 0;
  for (const FrameState state : e.states) tracked += state != FrameState::lost;
  EXPECT_GE(tracked, kFrames - 4);
}

TEST_F(Pipeline, NothingUsableIsAnErrorThatSaysSo) {
  const fs::path folder = root_ / "blank";
  synthetic::Recording recording{folder / "images", recording_.calibration, {}};
  make_folder(recording.images);
  for (int i = 0; i < 3; ++i)
    write_image(recording.images / (std::to_string(i) + ".png"),
                cv::Mat(240, 320, CV_8UC3, cv::Scalar(90, 95, 120)));
  try {
    run(recording, "blank_out");
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "images: 0 usable frames of 3, expected at least 2: the others show too little "
                 "texture, light or common wall to be placed");
  }
}

}  // namespace
}  // namespace rugae
