#include "dataset/check_dataset.h"

#include <gtest/gtest.h>

#include <functional>
#include <opencv2/core.hpp>

#include "core/files.h"
#include "dataset/image_io.h"
#include "dataset/manifest.h"
#include "tests/dataset/plane_dataset.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using testing::error_of;
using testing::PlaneWorld;
using testing::TemporaryFolder;
using Problems = std::vector<std::string>;

// Makes the manifest agree with the files again, so that only the fault itself is found.
void seal(const fs::path& root) {
  const DatasetLayout layout{root};
  const auto files = files_below(root, "manifest.sha256");
  write_atomic(layout.manifest(), manifest_text(files, hashes_of(root, files)));
}

class CheckDataset : public ::testing::Test {
 protected:
  CheckDataset() : folder_("check"), layout_{folder_.path() / "d"} { world_.write(layout_.root); }
  Problems problems() const { return check_dataset(layout_.root).problems; }
  std::string text(const fs::path& file) const { return file.string(); }

  // Writes every depth (or flow) again with what `change` makes of frame and image.
  void rewrite_depths(const std::function<cv::Mat(int)>& change) const {
    for (int i = 0; i < 5; ++i) write_exr(layout_.depth(i), change(i));
    seal(layout_.root);
  }
  void rewrite_flows(const std::function<cv::Mat(int)>& change) const {
    for (int i = 0; i < 4; ++i) write_exr(layout_.flow(i), change(i));
    seal(layout_.root);
  }

  PlaneWorld world_;
  TemporaryFolder folder_;
  DatasetLayout layout_;
};

TEST_F(CheckDataset, ASoundDatasetHasNoProblems) {
  const DatasetCheck result = check_dataset(layout_.root);
  EXPECT_EQ(result.problems, Problems{});
  EXPECT_EQ(result.frames, 5);
  EXPECT_EQ(result.files,
            30u);  // 6 of the whole, 5 frames, 5 each of depth, normals, masks, 4 flow
  EXPECT_GT(result.flow_samples, 1000u);
  // float32 flow and depth: about 1e-6 px each at this size.
  EXPECT_TRUE(result.worst_flow_px >= 0.0 && result.worst_flow_px <= 1e-4) << result.worst_flow_px;
}

TEST_F(CheckDataset, AFolderThatIsNoDatasetIsAnError) {
  EXPECT_EQ(error_of([&] { check_dataset(folder_.path() / "none"); }),
            text(folder_.path() / "none") + ": no such folder");
  EXPECT_EQ(error_of([&] { check_dataset(folder_.path()); }),
            text(folder_.path()) + ": not a dataset (no dataset.json)");
}

TEST_F(CheckDataset, AChangedByteIsNamed) {
  std::string bytes = read_text(layout_.depth(2));
  const std::size_t at = bytes.size() - 3;
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  const std::string before = sha256_of_file(layout_.depth(2)).substr(0, 8);
  write_atomic(layout_.depth(2), bytes);
  EXPECT_EQ(
      problems(),
      Problems{text(layout_.depth(2)) + ": changed since it was written (SHA-256 " +
               sha256_of_bytes(bytes).substr(0, 8) + "..., the manifest says " + before + "...)"});
}

TEST_F(CheckDataset, AMissingFileIsNamed) {
  fs::remove(layout_.frame(3));
  EXPECT_EQ(problems(), Problems{text(layout_.frame(3)) + ": missing"});
}

TEST_F(CheckDataset, AMissingPathIsNamed) {
  fs::remove(layout_.trajectory());
  EXPECT_EQ(problems(), Problems{text(layout_.trajectory()) + ": missing"});
}

TEST_F(CheckDataset, AMissingLabelIsNamedEvenIfTheManifestAgrees) {
  fs::remove(layout_.flow(1));
  seal(layout_.root);
  EXPECT_EQ(problems(), Problems{text(layout_.flow(1)) + ": missing"});
}

TEST_F(CheckDataset, AnExtraFileIsNamed) {
  write_atomic(layout_.truth() / "notes.txt", "x");
  EXPECT_EQ(problems(), Problems{text(layout_.truth() / "notes.txt") + ": not in the manifest"});
}

TEST_F(CheckDataset, AnUnfinishedDatasetIsNamed) {
  fs::remove(layout_.manifest());
  EXPECT_EQ(problems(),
            Problems{text(layout_.manifest()) + ": missing: the dataset was not finished"});
}

TEST_F(CheckDataset, ATruncatedImageIsNamed) {
  fs::resize_file(layout_.frame(3), fs::file_size(layout_.frame(3)) / 2);
  seal(layout_.root);
  EXPECT_EQ(problems(), Problems{text(layout_.frame(3)) + ": truncated or not an image"});
}

TEST_F(CheckDataset, ATruncatedImageThatTheManifestCatchesIsNamedTwice) {
  fs::resize_file(layout_.frame(3), fs::file_size(layout_.frame(3)) / 2);
  const Problems found = problems();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(found[0].starts_with(text(layout_.frame(3)) + ": changed since it was written"));
  EXPECT_EQ(found[1], text(layout_.frame(3)) + ": truncated or not an image");
}

TEST_F(CheckDataset, TruncatedLabelsAreNamed) {
  for (const fs::path& file : {layout_.depth(1), layout_.masks(2), layout_.normals(0)})
    fs::resize_file(file, fs::file_size(file) / 2);
  seal(layout_.root);
  EXPECT_EQ(problems(), (Problems{text(layout_.normals(0)) + ": truncated or not an image",
                                  text(layout_.depth(1)) + ": truncated or not an image",
                                  text(layout_.masks(2)) + ": truncated or not an image"}));
}

TEST_F(CheckDataset, AFrameOfAnotherSizeIsNamed) {
  write_image(layout_.frame(1), cv::Mat(48, 60, CV_8UC3, cv::Scalar()));
  seal(layout_.root);
  EXPECT_EQ(problems(), Problems{text(layout_.frame(1)) + ": 60 x 48 px, " +
                                 text(layout_.camera()) + " says 64 x 48"});
}

TEST_F(CheckDataset, APoseThatIsNoRotationIsNamed) {
  std::string track = read_text(layout_.trajectory());
  const auto line = track.find('\n', track.find('\n') + 1) + 1;  // the second pose, line 3
  const auto end = track.find('\n', line);
  track.replace(line, end - line, "0.1 0.8 -0.5 0.35 0 0 0.5 1");
  write_atomic(layout_.trajectory(), track);
  seal(layout_.root);
  EXPECT_EQ(problems(), Problems{text(layout_.trajectory()) +
                                 ":3: quaternion of norm 1.118033988749895, expected 1"});
}

TEST_F(CheckDataset, PosesThatNeverMoveAreNamed) {
  PoseTrack still = world_.track;
  for (TimedPose& pose : still) pose.world_from_camera = world_.track[0].world_from_camera;
  write_atomic(layout_.trajectory(), tum_text(still));
  seal(layout_.root);
  const Problems found = problems();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0], text(layout_.trajectory()) + ": the camera never moves: 5 equal poses");
  EXPECT_TRUE(found[1].starts_with(text(layout_.flow(0)) + ": disagrees with depth and pose"));
}

TEST_F(CheckDataset, ACameraThatOnlyShiftsOrOnlyTurnsMoves) {
  PlaneWorld shifts = world_, turns = world_;
  for (TimedPose& pose : shifts.track) pose.world_from_camera.rotation = Quat::Identity();
  for (TimedPose& pose : turns.track) pose.world_from_camera.translation.setZero();
  shifts.write(folder_.path() / "shifts");
  turns.write(folder_.path() / "turns");
  EXPECT_EQ(check_dataset(folder_.path() / "shifts").problems, Problems{});
  EXPECT_EQ(check_dataset(folder_.path() / "turns").problems, Problems{});
}

TEST_F(CheckDataset, TooFewPosesAreNamed) {
  PoseTrack track = world_.track;
  track.pop_back();
  write_atomic(layout_.trajectory(), tum_text(track));
  seal(layout_.root);
  EXPECT_EQ(problems(), Problems{text(layout_.trajectory()) + ": 4 poses for 5 frames"});
}

TEST_F(CheckDataset, TimesThatDifferAreNamed) {
  PoseTrack track = world_.track;
  track[2].time_s = 0.25;
  write_atomic(layout_.trajectory(), tum_text(track));
  seal(layout_.root);
  EXPECT_EQ(problems(), Problems{text(layout_.frame_list()) + ": frame 2 at 0.2 s, " +
                                 text(layout_.trajectory()) + " has 0.25 s"});
}

// The text of the one problem, which must begin with the flow of frame 0.
void expect_flow_problem(const Problems& found, const DatasetLayout& layout,
                         const std::string& tail) {
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].starts_with(layout.flow(0).string() + ": disagrees with depth and pose: "))
      << found[0];
  EXPECT_TRUE(found[0].ends_with(tail)) << found[0];
}

TEST_F(CheckDataset, DepthShiftedByOneFrameIsNamed) {
  // Every file holds the depth of the frame before; the first is doubled.
  rewrite_depths([&](int i) { return world_.truth(std::max(0, i - 1)).depth_mm; });
  const Problems found = problems();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].starts_with(layout_.flow(1).string() + ": disagrees with depth and pose: "));
  EXPECT_TRUE(
      found[0].ends_with("expected at most 0.001 and 0.01 px; the depth is shifted by one frame: "
                         "that of the next frame fits (and in 2 further frames)"))
      << found[0];
}

TEST_F(CheckDataset, FlowWithFlippedSignIsNamed) {
  rewrite_flows([&](int i) {
    const cv::Mat flow = world_.truth(i).flow_px;
    return cv::Mat(-flow);
  });
  expect_flow_problem(problems(), layout_,
                      "; the flow's sign is flipped (and in 3 further frames)");
}

TEST_F(CheckDataset, RangeInPlaceOfDepthIsNamed) {
  rewrite_depths([&](int i) {
    cv::Mat depth = world_.truth(i).depth_mm;
    for (int y = 0; y < depth.rows; ++y)
      for (int x = 0; x < depth.cols; ++x)
        depth.at<float>(y, x) /=
            static_cast<float>(world_.camera.lens.unproject(Vec2(x + 0.5, y + 0.5))->z());
    return depth;
  });
  expect_flow_problem(problems(), layout_,
                      "; the depth is the distance along the ray, not along z (and in 3 further "
                      "frames)");
}

TEST_F(CheckDataset, InvertedPosesAreNamed) {
  PoseTrack track = world_.track;
  for (TimedPose& pose : track) pose.world_from_camera = pose.world_from_camera.inverse();
  write_atomic(layout_.trajectory(), tum_text(track));
  seal(layout_.root);
  expect_flow_problem(problems(), layout_,
                      "; the poses are wrong: they are camera_from_world, expected "
                      "world_from_camera (and in 3 further frames)");
}

TEST_F(CheckDataset, OtherMistakesOfThePosesAreNamed) {
  const auto said = [&](const std::function<Rigid3(const Rigid3&)>& change) {
    PoseTrack track = world_.track;
    for (TimedPose& pose : track) pose.world_from_camera = change(pose.world_from_camera);
    write_atomic(layout_.trajectory(), tum_text(track));
    seal(layout_.root);
    const Problems found = problems();
    EXPECT_EQ(found.size(), 1u);
    const std::string text = found.empty() ? "" : found[0];
    return text.substr(std::min(text.size(), text.find("px; ") + 4));
  };
  EXPECT_EQ(said([](const Rigid3& p) { return Rigid3(p.rotation.conjugate(), p.translation); }),
            "the poses are wrong: their rotations are transposed (and in 3 further frames)");
  EXPECT_EQ(said([](const Rigid3& p) { return Rigid3(p.rotation, 0.001 * p.translation); }),
            "the poses are wrong: they are in metres where the depth is in millimetres (a factor "
            "1000) (and in 3 further frames)");
  EXPECT_EQ(said([](const Rigid3& p) {
              const Mat3 m = Vec3(1, -1, 1).asDiagonal();
              return Rigid3(Mat3(m * p.rotation.toRotationMatrix() * m), Vec3(m * p.translation));
            }),
            "the poses are wrong: their y axis is flipped: the axes are left-handed (and in 3 "
            "further frames)");
  EXPECT_EQ(said([](const Rigid3& p) { return Rigid3(Quat::Identity(), p.translation); }),
            "the rotation never changes (and in 3 further frames)");
}

TEST_F(CheckDataset, DepthThatIsZeroEverywhereIsNamed) {
  rewrite_depths([&](int i) {
    const cv::Mat depth = world_.truth(i).depth_mm;
    return cv::Mat(depth * 0.0);
  });
  EXPECT_EQ(problems(), Problems{text(layout_.depth(0)) +
                                 ": no depth above 0 anywhere (and in 4 further frames)"});
}

TEST_F(CheckDataset, ClampedFlowIsNamed) {
  rewrite_flows([&](int i) {
    cv::Mat flow = world_.truth(i).flow_px;
    for (cv::Vec2f& f : cv::Mat_<cv::Vec2f>(flow))
      for (int c = 0; c < 2; ++c)
        if (!std::isnan(f[c])) f[c] = std::clamp(f[c], -0.5f, 0.5f);
    return flow;
  });
  const Problems found = problems();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].find("; the flow is clamped at 0.5 px"), std::string::npos) << found[0];
}

TEST_F(CheckDataset, ASmallErrorOfTheFlowIsFound) {
  rewrite_flows([&](int i) {
    cv::Mat flow = world_.truth(i).flow_px;
    if (i == 0) cv::add(flow, cv::Scalar(0.02, 0.0), flow);
    return flow;
  });
  const Problems found = problems();
  EXPECT_EQ(found, Problems{text(layout_.flow(0)) +
                            ": disagrees with depth and pose: median 0.02 px, worst 0.02 px over " +
                            found.at(0).substr(found.at(0).find("over ") + 5, 3) +
                            " sampled pixels, expected at most 0.001 and 0.01 px; no usual mistake "
                            "explains it, nor two at once"});
}

TEST_F(CheckDataset, AnErrorBelowTheLargestAllowedButEverywhereIsFound) {
  rewrite_flows([&](int i) {
    cv::Mat flow = world_.truth(i).flow_px;
    cv::add(flow, cv::Scalar(0.0, 0.005), flow);
    return flow;
  });
  const Problems found = problems();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].starts_with(text(layout_.flow(0)) +
                                   ": disagrees with depth and pose: median 0.005 px, worst 0.005"))
      << found[0];
}

TEST_F(CheckDataset, WithoutFlowNothingIsCompared) {
  EXPECT_EQ(check_dataset(layout_.root).notes, Problems{});
  for (int i = 0; i < 5; ++i) {
    cv::Mat masks = world_.truth(i).masks;
    masks.setTo(kMaskValid);
    write_image(layout_.masks(i), masks);
  }
  rewrite_flows([&](int i) {
    cv::Mat flow = world_.truth(i).flow_px;
    flow.setTo(cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()));
    return flow;
  });
  const DatasetCheck found = check_dataset(layout_.root);
  EXPECT_EQ(found.problems, Problems{});
  EXPECT_EQ(found.notes,
            Problems{text(layout_.truth()) +
                     ": nothing could be compared: no pixel's flow to the next frame is known"});
}

TEST_F(CheckDataset, ADepthWithoutItsMaskIsNamed) {
  cv::Mat masks = world_.truth(1).masks;
  masks.at<unsigned char>(7, 5) = 0;
  write_image(layout_.masks(1), masks);
  seal(layout_.root);
  const auto line = [&](const fs::path& file, const char* what) {
    return text(file) + ": at column 5, row 7 there is a " + what + " though " +
           text(layout_.masks(1)) + " says invalid";
  };
  EXPECT_EQ(problems(),
            (Problems{line(layout_.depth(1), "depth"), line(layout_.normals(1), "normal"),
                      line(layout_.flow(1), "flow")}));
}

TEST_F(CheckDataset, ANormalFacingAwayIsNamed) {
  const cv::Mat normal = world_.truth(0).normal;
  write_normals(layout_.normals(0), cv::Mat(-normal));
  seal(layout_.root);
  const Problems found = problems();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].starts_with(text(layout_.normals(0)) + ": at column 1, row 1 the normal ("));
  EXPECT_TRUE(found[0].ends_with(") faces away from the camera"));
}

TEST_F(CheckDataset, ABrokenWallIsNamed) {
  fs::resize_file(layout_.wall(), fs::file_size(layout_.wall()) - 1);
  seal(layout_.root);
  EXPECT_EQ(problems(), Problems{text(layout_.wall()) +
                                 ": truncated or damaged: 121 bytes of data, expected 122"});
}

}  // namespace
}  // namespace rugae
