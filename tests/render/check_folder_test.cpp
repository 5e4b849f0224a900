// Rendered sequences as folders that others could have made: sound ones pass, and every usual
// mistake is named, with flow and without.

#include "dataset/check_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/files.h"
#include "dataset/check_dataset.h"
#include "render/simulate.h"
#include "tests/dataset/plain_set.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using testing::PlainSet;

// Paths through the coarse stomach with noise on, rendered once: a slow one, one with loops, and
// the slow one seen row by row through a stronger lens.
class CheckFolder : public ::testing::TestWithParam<int> {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::temp_directory_path() / fmt::format("rugae_check_folder_{}", getpid());
    fs::remove_all(root_);
    make_folder(root_);
    for (const bool rolling : {false, true})
      write_atomic(
          root_ / (rolling ? "rolling.yaml" : "camera.yaml"),
          fmt::format("lens: {{width: 160, height: 120, horizontal_fov_deg: 100, {}}}\n"
                      "sensor: {{pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, "
                      "read_noise_e: 10{}}}\n",
                      rolling ? "k1: -0.2, k2: 0.03, p1: 0.001" : "k1: -0.15, k2: 0.02",
                      rolling ? ", shutter: rolling, row_time_us: 250" : ""));
    write_atomic(root_ / "path0.yaml", "like: '1'\nlength_cm: 10\npasses: 1\n");
    write_atomic(root_ / "path1.yaml", "like: '3'\nlength_cm: 60\n");
    write_atomic(root_ / "path2.yaml", "like: path0.yaml\n");
    for (int path = 0; path < 3; ++path) {
      SimulateOptions options;
      options.camera = (root_ / (path == 2 ? "rolling.yaml" : "camera.yaml")).string();
      options.trajectory = (root_ / fmt::format("path{}.yaml", path)).string();
      options.resolution = "coarse";
      options.frames = 40;
      Progress progress(Progress::Output::silent);
      simulate(options, dataset(path), progress);
      sets_.push_back(PlainSet::of(dataset(path)));
    }
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  static fs::path dataset(int path) { return root_ / fmt::format("data{}", path); }
  static const PlainSet& set() { return sets_[static_cast<std::size_t>(GetParam() / 2)]; }

  // What is said of the set, with or without its flow by the test's parameter, one line a problem;
  // the folder's own name left out.
  static std::string said_of(const PlainSet& set, const PlainFolderOptions& options = {}) {
    const fs::path folder = root_ / "made by others";
    (GetParam() % 2 == 0 ? set : set.without_flow()).write(folder);
    const DatasetCheck found = check_folder(folder, options);
    notes_ = joined(found.notes, folder);
    return joined(found.problems, folder);
  }
  static std::string joined(const std::vector<std::string>& lines, const fs::path& folder) {
    std::string text;
    for (std::string line : lines) {
      for (std::size_t at; (at = line.find(folder.string() + "/")) != std::string::npos;)
        line.erase(at, folder.string().size() + 1);
      text += (text.empty() ? "" : "\n") + line;
    }
    return text;
  }
  static void expect_named(const PlainSet& set, const std::string& beginning) {
    const std::string said = said_of(set);
    EXPECT_EQ(said.substr(0, beginning.size()), beginning) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    if (std::getenv("SHOW")) std::cerr << GetParam() << ": " << said << "\n";
  }

  static fs::path root_;
  static std::string notes_;  // of the last folder
  static std::vector<PlainSet> sets_;
};
fs::path CheckFolder::root_;
std::string CheckFolder::notes_;
std::vector<PlainSet> CheckFolder::sets_;

INSTANTIATE_TEST_SUITE_P(PathsWithFlowAndWithout, CheckFolder, ::testing::Range(0, 6));

Rigid3 mirrored(const Rigid3& pose, const Vec3& signs) {
  const Mat3 m = signs.asDiagonal();
  return {Mat3(m * pose.rotation.toRotationMatrix() * m), Vec3(m * pose.translation)};
}
cv::Mat times(const cv::Mat& image, double factor) { return image * factor; }

TEST_P(CheckFolder, ASoundFolderAndASoundDatasetPass) {
  EXPECT_EQ(said_of(set()), "");
  EXPECT_EQ(notes_, "");
  EXPECT_EQ(check_dataset(dataset(GetParam() / 2)).problems, std::vector<std::string>{});
}

// The frames of `set` with these numbers, without flow.
PlainSet frames_of(const PlainSet& set, const std::vector<int>& numbers) {
  PlainSet few;
  few.lens = set.lens;
  for (const int i : numbers) {
    few.images.push_back(set.images[i]);
    few.depths_mm.push_back(set.depths_mm[i]);
    few.track.push_back({static_cast<double>(few.track.size()), set.track[i].world_from_camera});
  }
  return few;
}

// Neighbours see little of the same wall, or nothing.
TEST_P(CheckFolder, FramesTooFarApartToTellAreNotBlamed) {
  EXPECT_EQ(said_of(frames_of(set(), {0, 13, 26, 39})), "");
}

TEST_P(CheckFolder, FramesThatShareNoWallAreSaidToTellNothing) {
  if (GetParam() / 2 == 1) GTEST_SKIP() << "loops: much is seen again";
  EXPECT_EQ(said_of(frames_of(set(), {2, 37})), "");
  EXPECT_EQ(notes_,
            "depth, poses.txt, images: nothing could be compared: frames hardly show the same "
            "wall: as depth and poses have it, 0 % of a frame lies in another one");
}

TEST_P(CheckFolder, PartsThatLackAreNoted) {
  const fs::path folder = root_ / "made by others";
  frames_of(set(), {0, 1, 2}).write(folder);
  fs::remove(folder / "poses.txt");
  EXPECT_EQ(check_folder(folder, {}).notes,
            std::vector<std::string>{folder.string() +
                                     ": nothing could be compared: no file of poses (--poses)"});
  fs::remove_all(folder / "depth");
  EXPECT_EQ(check_folder(folder, {}).notes,
            std::vector<std::string>{folder.string() +
                                     ": nothing could be compared: no folder of depth (--depth), "
                                     "no file of poses (--poses)"});
  EXPECT_EQ(check_folder(folder, {}).problems, std::vector<std::string>{});
}

TEST_P(CheckFolder, DepthShiftedByAFrame) {
  expect_named(set().shifted(&PlainSet::depths_mm, 1),
               "depth: the depth is shifted by one frame: that of the frame before fits");
  expect_named(set().shifted(&PlainSet::depths_mm, -1),
               "depth: the depth is shifted by one frame: that of the next frame fits");
}

TEST_P(CheckFolder, PosesShiftedByAFrame) {
  expect_named(set().shifted(&PlainSet::track, 1),
               "poses.txt: the poses are shifted by one frame: ");
}

TEST_P(CheckFolder, ColourShiftedByAFrame) {
  if (GetParam() / 2 == 2) GTEST_SKIP() << "the last row is exposed nearly a frame after the first";
  expect_named(set().shifted(&PlainSet::images, 1),
               "images: colour and depth are misaligned by one frame: the images of the frame "
               "before fit depth "
               "and poses: ");
  expect_named(set().shifted(&PlainSet::images, -1),
               "images: colour and depth are misaligned by one frame: the images of the next frame "
               "fit depth and "
               "poses: ");
}

TEST_P(CheckFolder, TransposedRotations) {
  expect_named(set().with_poses(
                   [](const Rigid3& p) { return Rigid3(p.rotation.conjugate(), p.translation); }),
               "poses.txt: the poses are wrong: their rotations are transposed: ");
}

TEST_P(CheckFolder, CameraFromWorld) {
  expect_named(set().with_poses([](const Rigid3& p) { return p.inverse(); }),
               "poses.txt: the poses are wrong: they are camera_from_world, expected "
               "world_from_camera: ");
}

TEST_P(CheckFolder, MetresForMillimetres) {
  expect_named(
      set().with_poses([](const Rigid3& p) { return Rigid3(p.rotation, 0.001 * p.translation); }),
      "poses.txt: the poses are wrong: they are in metres where the depth is in "
      "millimetres (a factor 1000): ");
  expect_named(set().with_depths([](const cv::Mat& d) { return times(d, 0.001); }),
               "poses.txt: the poses are wrong: they are in millimetres where the depth is in "
               "metres (a factor 1000): ");
}

TEST_P(CheckFolder, AnotherUnit) {
  expect_named(
      set().with_poses([](const Rigid3& p) { return Rigid3(p.rotation, p.translation / 25.4); }),
      "poses.txt: the poses are wrong: their lengths are not in the unit of the depth (a "
      "factor 25.");
}

// Over a short stretch a small factor looks a little like other mistakes.
TEST_P(CheckFolder, AnotherUnitOverAFewFrames) {
  PlainSet few = set();
  few.track.resize(12);
  few.images.resize(12);
  few.depths_mm.resize(12);
  if (!few.flows_px.empty()) few.flows_px.resize(11);
  const std::string beginning =
      "poses.txt: the poses are wrong: their lengths are not in the unit of the depth (a factor ";
  constexpr double kOfRows = 0.1;  // of a rolling shutter no pose holds for the whole frame
  for (const double factor : {5.0, 0.2}) {
    const PlainSet wrong = few.with_depths([factor](const cv::Mat& d) { return times(d, factor); });
    expect_named(wrong, beginning);
    EXPECT_NEAR(std::atof(said_of(wrong).substr(beginning.size()).c_str()), 5.0, kOfRows);
  }
}

TEST_P(CheckFolder, LeftHandedAxes) {
  expect_named(
      set().with_poses([](const Rigid3& p) {
        return mirrored(p, {1, -1, 1});
      }),
      "poses.txt: the poses are wrong: their y axis is flipped: the axes are left-handed: ");
  expect_named(
      set().with_poses([](const Rigid3& p) {
        return mirrored(p, {1, 1, -1});
      }),
      "poses.txt: the poses are wrong: their z axis is flipped: the axes are left-handed: ");
}

TEST_P(CheckFolder, AxesOfOpenGl) {
  expect_named(set().with_poses([](const Rigid3& p) {
    return mirrored(p, {1, -1, -1});
  }),
               "poses.txt: the poses are wrong: their axes are y up, z backward (OpenGL), expected "
               "y down, z forward: ");
}

TEST_P(CheckFolder, FrozenRotation) {
  expect_named(set().with_poses([](const Rigid3& p) {
    return Rigid3(set().track[0].world_from_camera.rotation, p.translation);
  }),
               "poses.txt: the rotation never changes, though the camera turns by ");
}

TEST_P(CheckFolder, DepthAlongTheRay) {
  const Lens& lens = set().lens;
  expect_named(set().with_depths([&](const cv::Mat& z) {
    cv::Mat range = z.clone();
    for (int y = 0; y < z.rows; ++y)
      for (int x = 0; x < z.cols; ++x)
        range.at<float>(y, x) /= static_cast<float>(lens.unproject(Vec2(x + 0.5, y + 0.5))->z());
    return range;
  }),
               "depth: the depth is the distance along the ray, not along z: ");
}

TEST_P(CheckFolder, DepthThatIsZeroOrTheSameEverywhere) {
  EXPECT_EQ(said_of(set().with_depths([](const cv::Mat& d) { return times(d, 0.0); })),
            "depth/0.exr: no depth above 0 anywhere (and 39 further files)");
  EXPECT_EQ(said_of(set().with_depths(
                [](const cv::Mat& d) { return cv::Mat(d.size(), d.type(), cv::Scalar(20.0)); })),
            "depth/0.exr: the depth is 20 mm everywhere (and 39 further files)");
}

TEST_P(CheckFolder, FlowWithFlippedSign) {
  if (GetParam() % 2 != 0) GTEST_SKIP() << "without flow";
  expect_named(set().with_flows([](const cv::Mat& f) { return times(f, -1.0); }),
               "flow: the flow's sign is flipped: ");
}

Rigid3 transposed(const Rigid3& p) { return {p.rotation.conjugate(), p.translation}; }

TEST_P(CheckFolder, TwoMistakesAtOnceAreBothNamed) {
  expect_named(
      set().with_depths([](const cv::Mat& d) { return times(d, 0.001); }).with_poses(transposed),
      "poses.txt: two mistakes at once: the poses are wrong: their rotations are "
      "transposed, and they are in millimetres where the depth is in metres (a factor "
      "1000): ");
  expect_named(set().with_poses([](const Rigid3& p) {
    return mirrored(Rigid3(p.rotation, 0.001 * p.translation), {1, 1, -1});
  }),
               "poses.txt: two mistakes at once: the poses are wrong: they are in metres where the "
               "depth is in millimetres (a factor 1000), and their z axis is flipped: the axes are "
               "left-handed: ");
}

// In one line or in two.
TEST_P(CheckFolder, AShiftBesideAnotherMistakeIsNamedToo) {
  const auto expect_both = [](const PlainSet& faulty, const std::string& one) {
    const std::string said = said_of(faulty);
    EXPECT_NE(said.find(one), std::string::npos) << said;
    EXPECT_NE(said.find("the depth is shifted by one frame: that of the frame before fits"),
              std::string::npos)
        << said;
    EXPECT_EQ(said.find("no usual mistake"), std::string::npos) << said;
  };
  const PlainSet shifted = set().shifted(&PlainSet::depths_mm, 1);
  if (GetParam() % 2 == 0)
    expect_both(shifted.with_flows([](const cv::Mat& f) { return times(f, -1.0); }),
                "the flow's sign is flipped");
  expect_both(shifted.with_poses(transposed), "their rotations are transposed");
  expect_both(
      shifted.with_poses([](const Rigid3& p) { return Rigid3(p.rotation, 0.001 * p.translation); }),
      "they are in metres where the depth is in millimetres (a factor 1000)");
}

TEST_P(CheckFolder, WhatNothingExplainsIsSaidToDisagree) {
  const std::string said = said_of(set().with_poses([](const Rigid3& p) {
    return Rigid3(p.rotation.conjugate(), 7.3 * p.translation.cwiseProduct(Vec3(1, -1, 1)));
  }));
  EXPECT_NE(said.find("disagrees with "), std::string::npos) << said;
  EXPECT_TRUE(said.ends_with("no usual mistake explains it, nor two at once")) << said;
}

TEST_P(CheckFolder, ClampedFlow) {
  if (GetParam() % 2 != 0) GTEST_SKIP() << "without flow";
  const std::string said = said_of(set().with_flows([](const cv::Mat& f) {
    cv::Mat clamped = f.clone();
    for (cv::Vec2f& v : cv::Mat_<cv::Vec2f>(clamped))
      for (int c = 0; c < 2; ++c)
        if (!std::isnan(v[c])) v[c] = std::clamp(v[c], -2.0f, 2.0f);
    return clamped;
  }));
  EXPECT_NE(said.find(".exr: the flow is clamped at 2 px (and "), std::string::npos) << said;
}

}  // namespace
}  // namespace rugae
