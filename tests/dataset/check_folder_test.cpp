// Folders made by others: what is found by which name, which files are read, and what is said of
// those that will not do. A plane before a camera; mistakes of poses are in tests/render.

#include "dataset/check_folder.h"

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>

#include "dataset/manifest.h"
#include "tests/dataset/plain_set.h"
#include "tests/dataset/plane_dataset.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using testing::error_of;
using testing::PlainSet;
using testing::PlaneWorld;
using testing::TemporaryFolder;
using Problems = std::vector<std::string>;

class PlainFolders : public ::testing::Test {
 protected:
  PlainFolders() : folder_("plain"), root_(folder_.path() / "d") {
    const PlaneWorld world(8);
    set_.lens = world.camera.lens;
    set_.track = world.track;
    for (int i = 0; i < 8; ++i) {
      set_.images.push_back(world.image(i));
      set_.depths_mm.push_back(world.truth(i).depth_mm);
      if (i < 7) set_.flows_px.push_back(world.truth(i).flow_px);
    }
    set_.write(root_);
  }
  Problems problems(const PlainFolderOptions& options = {}) const {
    return check_folder(root_, options).problems;
  }
  std::string text(const std::string& part) const { return (root_ / part).string(); }

  TemporaryFolder folder_;
  fs::path root_;
  PlainSet set_;
};

TEST_F(PlainFolders, ASoundOneHasNoProblems) {
  const DatasetCheck result = check_folder(root_, {});
  EXPECT_EQ(result.problems, Problems{});
  EXPECT_EQ(result.frames, 8);
  EXPECT_EQ(result.files, 8u + 8u + 7u + 2u);
  EXPECT_TRUE(result.worst_flow_px >= 0.0 && result.worst_flow_px <= 1e-4) << result.worst_flow_px;
}

TEST_F(PlainFolders, PartsAreFoundByOtherNamesOrAsTold) {
  fs::rename(root_ / "images", root_ / "rgb");
  fs::rename(root_ / "depth", root_ / "depth_maps");
  fs::rename(root_ / "poses.txt", root_ / "groundtruth.txt");
  EXPECT_EQ(check_folder(root_, {}).worst_flow_px >= 0.0, true);  // all three were found
  fs::rename(root_ / "rgb", root_ / "what the camera saw");
  EXPECT_EQ(error_of([&] { problems(); }),
            root_.string() +
                ": no folder of images (looked for images, image, rgb, color, colour, "
                "frames, img, left, observations/frames); name it with --images");
  PlainFolderOptions told;
  told.images = root_ / "what the camera saw";
  EXPECT_EQ(problems(told), Problems{});
  told.poses = root_ / "nowhere.txt";
  EXPECT_EQ(error_of([&] { problems(told); }), text("nowhere.txt") + ": no such file or folder");
  EXPECT_EQ(error_of([&] { check_folder(root_ / "none", {}); }), text("none") + ": no such folder");
}

TEST_F(PlainFolders, SixteenBitDepthNeedsItsScale) {
  fs::remove_all(root_ / "depth");
  make_folder(root_ / "depth");
  constexpr double kUnitsPerMm = 200.0;
  for (std::size_t i = 0; i < set_.depths_mm.size(); ++i) {
    cv::Mat units;
    set_.depths_mm[i].convertTo(units, CV_16U, kUnitsPerMm);
    write_image(root_ / "depth" / fmt::format("{}.png", i), units);
  }
  PlainFolderOptions options;
  options.depth_scale = 1.0 / kUnitsPerMm;
  EXPECT_EQ(problems(options), Problems{});
  const Problems found = problems();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].substr(0, found[0].find(" between")),
            text("poses.txt") +
                ": the poses are wrong: their lengths are not in the unit of the "
                "depth (a factor 200");
  options.depth_scale = -1.0;
  EXPECT_EQ(error_of([&] { problems(options); }), "depth-scale is -1, expected above 0");
}

TEST_F(PlainFolders, EightBitDepthIsRefused) {
  fs::remove_all(root_ / "depth");
  make_folder(root_ / "depth");
  for (int i = 0; i < 8; ++i)
    write_image(root_ / "depth" / fmt::format("{}.png", i),
                cv::Mat(48, 64, CV_8UC1, cv::Scalar(30)));
  EXPECT_EQ(problems(),
            Problems{text("depth/0.png") + ": depth is stored as CV_8UC1, expected 16-bit of one "
                                           "channel (and 7 further files)"});
}

void write_flo(const fs::path& file, const cv::Mat& flow) {
  std::string bytes = "PIEH";
  const std::int32_t size[2] = {flow.cols, flow.rows};
  bytes.append(reinterpret_cast<const char*>(size), sizeof(size));
  cv::Mat whole = flow.clone();
  for (cv::Vec2f& f : cv::Mat_<cv::Vec2f>(whole))
    if (std::isnan(f[0])) f = cv::Vec2f::all(1.6e9f);  // Middlebury's "unknown"
  bytes.append(reinterpret_cast<const char*>(whole.data), whole.total() * whole.elemSize());
  write_atomic(file, bytes);
}

TEST_F(PlainFolders, FlowIsReadFromMiddleburysFiles) {
  fs::remove_all(root_ / "flow");
  make_folder(root_ / "flow");
  for (std::size_t i = 0; i < set_.flows_px.size(); ++i)
    write_flo(root_ / "flow" / fmt::format("{}.flo", i), set_.flows_px[i]);
  const DatasetCheck sound = check_folder(root_, {});
  EXPECT_EQ(sound.problems, Problems{});
  EXPECT_TRUE(sound.worst_flow_px >= 0.0 && sound.worst_flow_px <= 1e-4) << sound.worst_flow_px;
  fs::resize_file(root_ / "flow" / "3.flo", 100);
  EXPECT_EQ(problems(), Problems{text("flow/3.flo") + ": truncated or not a flow file"});
}

TEST_F(PlainFolders, CountsAndSizesThatDifferAreNamed) {
  fs::remove(root_ / "depth" / "7.exr");
  fs::remove(root_ / "flow" / "6.exr");
  write_image(root_ / "images" / "2.png", cv::Mat(20, 30, CV_8UC3, cv::Scalar()));
  PoseTrack track = set_.track;
  track.pop_back();
  write_atomic(root_ / "poses.txt", tum_text(track));
  EXPECT_EQ(problems(), (Problems{text("images/2.png") + ": 30 x 20 px, " +
                                      text("calibration.yaml") + " says 64 x 48",
                                  text("depth") + ": 7 files for 8 images",
                                  text("flow") + ": 6 files for 8 images (the last may have none)",
                                  text("poses.txt") + ": 7 poses for 8 images"}));
}

TEST_F(PlainFolders, WithoutACalibrationOnlyTheFilesAreChecked) {
  fs::remove(root_ / "calibration.yaml");
  EXPECT_EQ(problems(), Problems{root_.string() +
                                 ": no calibration; name it with --calibration (nothing can be led "
                                 "from frame to frame without)"});
}

TEST_F(PlainFolders, MasksPromiseWhatDepthHolds) {
  make_folder(root_ / "masks");
  for (int i = 0; i < 8; ++i)
    write_image(root_ / "masks" / fmt::format("{}.png", i),
                cv::Mat(48, 64, CV_8UC1, cv::Scalar(255)));
  EXPECT_EQ(problems(), Problems{});
  cv::Mat depth = set_.depths_mm[3].clone();
  depth.rowRange(10, 20).setTo(0.0);
  write_exr(root_ / "depth" / "3.exr", depth);
  EXPECT_EQ(problems(),
            Problems{text("masks/3.png") + ": marks 640 of 3072 pixels as valid where " +
                     text("depth/3.exr") + " has no depth, first at column 0, row 10"});
}

TEST_F(PlainFolders, AManifestIsHeldTo) {
  const auto files = files_below(root_, "manifest.sha256");
  write_atomic(root_ / "manifest.sha256", manifest_text(files, hashes_of(root_, files)));
  EXPECT_EQ(problems(), Problems{});
  write_atomic(root_ / "poses.txt", read_text(root_ / "poses.txt") + "# again\n");
  const Problems found = problems();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].starts_with(text("poses.txt") + ": changed since it was written"))
      << found[0];
}

TEST_F(PlainFolders, BrokenPosesAreNamedByLine) {
  write_atomic(root_ / "poses.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0.5 0.5 0.5 1\n");
  EXPECT_EQ(problems(),
            Problems{text("poses.txt") + ":2: quaternion of norm 1.3228756555322954, expected 1"});
}

}  // namespace
}  // namespace rugae
