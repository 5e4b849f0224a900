// Rendered datasets in which the usual mistakes are planted, one and two at a time: each is named.
// A still wall through a lens with distortion, the same row by row, and a wall that moves.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/pose_track.h"
#include "dataset/check_dataset.h"
#include "dataset/image_io.h"
#include "dataset/layout.h"
#include "dataset/manifest.h"
#include "render/simulate.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;

constexpr int kFrames = 8;

class PlantedFaults : public ::testing::TestWithParam<std::string> {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::temp_directory_path() / fmt::format("rugae_planted_{}", getpid());
    fs::remove_all(root_);
    make_folder(root_);
    write_atomic(root_ / "still.yaml", "like: stomach\n");
    write_atomic(root_ / "moving.yaml",
                 "like: stomach-moving\ndeformation: {speed_mm_s: 12, waves_per_minute: 12}\n");
    write_atomic(root_ / "path.yaml", "like: '4'\nlength_cm: 3\npasses: 1\n");
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  // Rendered once for each parameter; a copy for each test.
  void SetUp() override {
    const std::string& world = GetParam();
    const bool rolling = world != "distorted", moving = world.starts_with("moving");
    const fs::path made = root_ / world;
    if (!fs::exists(made)) {
      write_atomic(root_ / "camera.yaml",
                   fmt::format("name: small\nlens: {{model: {}, width: 96, height: 72, "
                               "horizontal_fov_deg: 100, k1: -0.2, k2: 0.03}}\n"
                               "sensor: {{pixel_pitch_um: 6, fps: 30, bit_depth: 10, "
                               "full_well_e: 18000, read_noise_e: 10{}}}\n",
                               world == "moving fisheye" ? "kannala_brandt" : "brown_conrady",
                               rolling ? ", shutter: rolling, row_time_us: 300" : ""));
      SimulateOptions options;
      options.scene = (root_ / (moving ? "moving.yaml" : "still.yaml")).string();
      options.camera = (root_ / "camera.yaml").string();
      options.trajectory = (root_ / "path.yaml").string();
      options.resolution = "coarse";
      options.frames = kFrames;
      Progress progress(Progress::Output::silent);
      simulate(options, made, progress);
    }
    layout_.root = root_ / "planted";
    fs::remove_all(layout_.root);
    fs::copy(made, layout_.root, fs::copy_options::recursive);
  }

  // The mistakes, each written into the files.
  void depths(const std::function<cv::Mat(int)>& change) const {
    rewrite(kFrames, change, &DatasetLayout::depth);
  }
  void flows(const std::function<cv::Mat(int)>& change) const {
    rewrite(kFrames - 1, change, &DatasetLayout::flow);
  }
  void shift_depths(int by) const {
    depths([&](int i) { return read_exr(layout_.depth(std::clamp(i + by, 0, kFrames - 1))); });
  }
  void scale_depths(double factor) const {
    depths([&](int i) { return cv::Mat(read_exr(layout_.depth(i)) * factor); });
  }
  void flip_flows() const {
    flows([&](int i) { return cv::Mat(-read_exr(layout_.flow(i))); });
  }
  void poses(const std::function<Rigid3(const Rigid3&)>& change, bool rows_too = true) const {
    std::vector<fs::path> files = {layout_.trajectory()};
    for (int i = 0; rows_too && i < kFrames; ++i)
      if (fs::exists(layout_.row_poses(i))) files.push_back(layout_.row_poses(i));
    for (const fs::path& file : files) {
      PoseTrack track = read_tum(file);
      for (TimedPose& pose : track) pose.world_from_camera = change(pose.world_from_camera);
      write_atomic(file, tum_text(track));
    }
  }
  static Rigid3 transposed(const Rigid3& p) { return {p.rotation.conjugate(), p.translation}; }
  static Rigid3 in_metres(const Rigid3& p) { return {p.rotation, 0.001 * p.translation}; }
  static Rigid3 left_handed(const Rigid3& p) {
    const Mat3 m = Vec3(1, -1, 1).asDiagonal();
    return {Mat3(m * p.rotation.toRotationMatrix() * m), Vec3(m * p.translation)};
  }
  Rigid3 first() const { return read_tum(layout_.trajectory())[0].world_from_camera; }

  // What is said, with the manifest made to agree; the folder's name left out.
  std::vector<std::string> said() const {
    const auto files = files_below(layout_.root, "manifest.sha256");
    write_atomic(layout_.manifest(), manifest_text(files, hashes_of(layout_.root, files)));
    std::vector<std::string> problems = check_dataset(layout_.root).problems;
    for (std::string& problem : problems)
      for (std::size_t at; (at = problem.find(layout_.root.string() + "/")) != std::string::npos;)
        problem.erase(at, layout_.root.string().size() + 1);
    return problems;
  }
  // Exactly one problem: the flow of `frame` disagrees, and the reason.
  void expect_named(const std::string& reason, int frame = 0) const {
    const auto problems = said();
    ASSERT_EQ(problems.size(), 1u) << ::testing::PrintToString(problems);
    const std::string begins =
        fmt::format("truth/flow/{:06}.exr: disagrees with depth and pose: median ", frame);
    EXPECT_TRUE(problems[0].starts_with(begins)) << problems[0];
    EXPECT_TRUE(problems[0].ends_with(" expected at most 0.001 and 0.01 px; " + reason))
        << problems[0];
  }

  static fs::path root_;
  DatasetLayout layout_;

 private:
  void rewrite(int frames, const std::function<cv::Mat(int)>& change,
               fs::path (DatasetLayout::*file)(int) const) const {
    std::vector<cv::Mat> images;
    for (int i = 0; i < frames; ++i) images.push_back(change(i));
    for (int i = 0; i < frames; ++i)
      write_exr((layout_.*file)(i), images[static_cast<std::size_t>(i)]);
  }
};
fs::path PlantedFaults::root_;

INSTANTIATE_TEST_SUITE_P(Worlds, PlantedFaults,
                         ::testing::Values("distorted", "rolling", "moving", "moving fisheye"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase(name, ' ');
                           return name;
                         });

TEST_P(PlantedFaults, NothingIsSaidOfASoundOne) {
  EXPECT_EQ(said(), std::vector<std::string>{});
  const DatasetCheck found = check_dataset(layout_.root);
  EXPECT_TRUE(found.worst_flow_px >= 0.0 && found.worst_flow_px <= 0.01) << found.worst_flow_px;
  EXPECT_GT(found.flow_samples, 2000u);
}

TEST_P(PlantedFaults, DepthShiftedByAFrame) {
  shift_depths(-1);  // the first is doubled, and fits
  expect_named(
      "the depth is shifted by one frame: that of the next frame fits (and in 5 further frames)",
      1);
}

TEST_P(PlantedFaults, DepthShiftedByAFrameTheOtherWay) {
  shift_depths(1);  // that of the first frame is in no file, but the others' are in the next ones
  expect_named(
      "the depth is shifted by one frame: that of the frame before fits (and in 6 further frames)");
}

TEST_P(PlantedFaults, TransposedRotations) {
  poses(transposed);
  expect_named("the poses are wrong: their rotations are transposed (and in 6 further frames)");
}

TEST_P(PlantedFaults, MetresForMillimetres) {
  poses(in_metres);
  expect_named(
      "the poses are wrong: they are in metres where the depth is in millimetres (a factor 1000) "
      "(and in 6 further frames)");
}

TEST_P(PlantedFaults, DepthInMetres) {
  scale_depths(0.001);
  expect_named(
      "the poses are wrong: they are in millimetres where the depth is in metres (a factor 1000) "
      "(and in 6 further frames)");
}

TEST_P(PlantedFaults, FlowWithFlippedSign) {
  flip_flows();
  expect_named("the flow's sign is flipped (and in 6 further frames)");
}

TEST_P(PlantedFaults, FrozenRotation) {
  const Quat rotation = first().rotation;
  poses([&](const Rigid3& p) { return Rigid3(rotation, p.translation); });
  expect_named("the rotation never changes (and in 6 further frames)");
}

TEST_P(PlantedFaults, LeftHandedAxes) {
  poses(left_handed);
  expect_named(
      "the poses are wrong: their y axis is flipped: the axes are left-handed (and in 6 further "
      "frames)");
}

TEST_P(PlantedFaults, TwoAtOnceAreBothNamed) {
  scale_depths(0.001);
  poses(transposed);
  expect_named(
      "two mistakes at once: the poses are wrong: their rotations are transposed, and the poses "
      "are wrong: they are in millimetres where the depth is in metres (a factor 1000) (and in 6 "
      "further frames)");
}

TEST_P(PlantedFaults, ShiftedDepthAndFlippedFlowAreBothNamed) {
  shift_depths(-1);
  flip_flows();
  const auto problems = said();
  ASSERT_EQ(problems.size(), 2u) << ::testing::PrintToString(problems);
  // the first depth is doubled: only the flow is wrong there
  EXPECT_TRUE(problems[0].starts_with("truth/flow/000000.exr: ")) << problems[0];
  EXPECT_TRUE(problems[0].ends_with(" px; the flow's sign is flipped")) << problems[0];
  EXPECT_TRUE(problems[1].starts_with("truth/flow/000001.exr: ")) << problems[1];
  EXPECT_TRUE(problems[1].ends_with(
      "; two mistakes at once: the depth is shifted by one frame: that of the next frame fits, and "
      "the flow's sign is flipped (and in 5 further frames)"))
      << problems[1];
}

TEST_P(PlantedFaults, ThreeAtOnceAreNotPretendedToBeKnown) {
  scale_depths(0.001);
  poses(transposed);
  flip_flows();
  expect_named("no usual mistake explains it, nor two at once (and in 6 further frames)");
}

// trajectory.txt alone is wrong: what is seen row by row still agrees with itself.
TEST_P(PlantedFaults, ATrajectoryThatIsNotThatOfItsRows) {
  if (GetParam() == "distorted") GTEST_SKIP() << "all rows at once";
  const auto expect_ending = [&](const std::string& ending) {
    const auto problems = said();
    ASSERT_EQ(problems.size(), 1u) << ::testing::PrintToString(problems);
    EXPECT_TRUE(problems[0].starts_with("truth/trajectory.txt: the pose of frame ")) << problems[0];
    EXPECT_TRUE(problems[0].ends_with(ending)) << problems[0];
    EXPECT_NE(problems[0].find(" degrees off that of the middle row in truth/row_poses/"),
              std::string::npos)
        << problems[0];
  };
  const std::string sound = read_text(layout_.trajectory());
  poses(transposed, false);
  expect_ending(".txt; the poses are wrong: their rotations are transposed");
  write_atomic(layout_.trajectory(), sound);
  poses(left_handed, false);
  expect_ending(".txt; the poses are wrong: their y axis is flipped: the axes are left-handed");
  write_atomic(layout_.trajectory(), sound);
  const Quat rotation = first().rotation;
  poses([&](const Rigid3& p) { return Rigid3(rotation, p.translation); }, false);
  expect_ending(".txt; the rotation never changes");
  write_atomic(layout_.trajectory(), sound);
  PoseTrack track = read_tum(layout_.trajectory());
  for (std::size_t i = 0; i + 1 < track.size(); ++i)
    track[i].world_from_camera = track[i + 1].world_from_camera;
  write_atomic(layout_.trajectory(), tum_text(track));
  expect_ending(".txt; the poses are shifted by one frame: those of the frame before fit");
}

// The wall is followed: were it taken to stand still, flow would not agree.
TEST_P(PlantedFaults, AWallThatMovesOtherwiseIsFound) {
  if (!GetParam().starts_with("moving")) GTEST_SKIP() << "a still wall";
  EXPECT_FALSE(fs::exists(layout_.triangles(0)));
  std::vector<std::string> motions;
  for (int i = 0; i < kFrames; ++i) motions.push_back(read_text(layout_.wall_motion(i)));
  for (int i = 0; i < kFrames; ++i) write_atomic(layout_.wall_motion(i), motions[0]);
  expect_named("no usual mistake explains it, nor two at once (and in 6 further frames)");
}

}  // namespace
}  // namespace rugae
