#include "dataset/writer.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <map>
#include <opencv2/core.hpp>
#include <sstream>

#include "core/files.h"
#include "dataset/check_dataset.h"
#include "dataset/manifest.h"
#include "tests/dataset/plane_dataset.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using testing::error_of;
using testing::PlaneWorld;
using testing::TemporaryFolder;

// Every file of the folder by the checksum of its bytes.
std::map<std::string, std::string> bytes_of(const fs::path& root) {
  std::map<std::string, std::string> sums;
  for (const std::string& file : files_below(root, "")) sums[file] = sha256_of_file(root / file);
  return sums;
}

TEST(Writer, TruthComesBackAsItWasWritten) {
  const TemporaryFolder folder("writer_back");
  const PlaneWorld world;
  world.write(folder.path() / "d");
  const Truth truth = Truth::open(folder.path() / "d");
  ASSERT_EQ(truth.size(), 5);
  EXPECT_EQ(truth.camera().name, "tiny");
  EXPECT_EQ(truth.camera().sensor.full_well_e, 10000.0);
  EXPECT_EQ(truth.camera().lens.k2, world.camera.lens.k2);
  EXPECT_EQ(truth.camera().vignetting.cos4, world.camera.vignetting.cos4);
  for (int i = 0; i < 5; ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(truth.track()[at].time_s, world.track[at].time_s);
    EXPECT_EQ(truth.track()[at].world_from_camera.translation,
              world.track[at].world_from_camera.translation);
    const FrameTruth expected = world.truth(i);
    const auto same = [](const cv::Mat& a, const cv::Mat& b) {
      return a.type() == b.type() && a.size() == b.size() &&
             std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
    };
    EXPECT_TRUE(same(truth.depth_mm(i), expected.depth_mm));
    EXPECT_TRUE(same(truth.masks(i), expected.masks));
    if (i < 4) {
      EXPECT_TRUE(same(truth.flow_px(i), expected.flow_px));
    }
    constexpr double kRounding = 3.2e-5;  // half a step of the 16-bit code, renormalised
    EXPECT_TRUE(cv::norm(truth.normal(i), expected.normal, cv::NORM_INF) <= kRounding);
  }
  ASSERT_EQ(truth.wall().vertices.size(), 4u);
  for (std::size_t v = 0; v < 4; ++v)
    EXPECT_EQ(truth.wall().vertices[v], world.wall().vertices[v]);  // double precision on disk
  EXPECT_EQ(truth.wall().triangles, world.wall().triangles);
}

TEST(Writer, TwoRunsGiveTheSameBytes) {
  const TemporaryFolder folder("writer_twice");
  const PlaneWorld world;
  world.write(folder.path() / "a");
  world.write(folder.path() / "b");
  EXPECT_EQ(bytes_of(folder.path() / "a"), bytes_of(folder.path() / "b"));
}

TEST(Writer, FramesMayComeFromSeveralThreads) {
  const TemporaryFolder folder("writer_threads");
  const PlaneWorld world(16);
  world.write(folder.path() / "a");
  DatasetWriter writer(folder.path() / "b", world.info());
  writer.write_scene(world.camera, world.track, world.wall());
  tbb::parallel_for(0, 16, [&](int i) { writer.write_frame(i, world.image(i), world.truth(i)); });
  writer.finish(std::vector<double>(16, 0.01), std::vector<double>(16, 1.0));
  EXPECT_EQ(bytes_of(folder.path() / "a"), bytes_of(folder.path() / "b"));
}

TEST(Writer, AKilledRunIsContinuedToTheSameBytes) {
  const TemporaryFolder folder("writer_killed");
  const PlaneWorld world;
  world.write(folder.path() / "whole");
  const fs::path killed = folder.path() / "killed";
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    DatasetWriter writer(killed, world.info());
    writer.write_scene(world.camera, world.track, world.wall());
    writer.write_frame(0, world.image(0), world.truth(0));
    writer.write_frame(1, world.image(1), world.truth(1));
    // In the middle of frame 2: some labels are whole, one is half written.
    FrameTruth truth = world.truth(2);
    fs::copy_file(writer.layout().depth(1), writer.layout().depth(2));
    fs::copy_file(writer.layout().flow(1), temporary_for(writer.layout().flow(2)));
    fs::resize_file(temporary_for(writer.layout().flow(2)), 100);
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  {
    const DatasetWriter writer(killed, world.info());
    EXPECT_TRUE(writer.has_frame(0));
    EXPECT_TRUE(writer.has_frame(1));
    EXPECT_FALSE(writer.has_frame(2));
    EXPECT_FALSE(fs::exists(writer.layout().manifest()));
    EXPECT_FALSE(fs::exists(temporary_for(writer.layout().flow(2))));
  }
  world.write(killed);
  EXPECT_EQ(bytes_of(killed), bytes_of(folder.path() / "whole"));
}

TEST(Writer, TheManifestIsReadBySha256sum) {
  const TemporaryFolder folder("writer_sum");
  PlaneWorld().write(folder.path() / "d");
  const std::string command = "cd '" + (folder.path() / "d").string() +
                              "' && sha256sum --strict --status -c manifest.sha256";
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::istringstream manifest(read_text(folder.path() / "d" / "manifest.sha256"));
  std::vector<std::string> files;
  for (std::string hash, file; manifest >> hash >> file;) files.push_back(file);
  EXPECT_EQ(files.size(), 30u);
  EXPECT_TRUE(std::ranges::is_sorted(files));  // whatever the order of the folders on disk
  write_atomic(folder.path() / "d" / "observations" / "frames.csv", "changed");
  EXPECT_NE(std::system(command.c_str()), 0);
}

TEST(Writer, AnotherDatasetIsNotContinued) {
  const TemporaryFolder folder("writer_other");
  const fs::path root = folder.path() / "d";
  const PlaneWorld world;
  world.write(root);
  const auto refusal = [&root](const std::string& difference) {
    return root.string() + ": holds another dataset (" + difference +
           "); choose another folder or remove it";
  };
  DatasetInfo info = world.info();
  info.seed = 2;
  EXPECT_EQ(error_of([&] { DatasetWriter(root, info); }), refusal("seed is 1, now 2"));
  info = world.info();
  info.trajectory = "4";
  EXPECT_EQ(error_of([&] { DatasetWriter(root, info); }),
            refusal("trajectory is \"line\", now \"4\""));
  info = world.info();
  info.text = R"({"noise": true})";
  EXPECT_EQ(error_of([&] { DatasetWriter(root, info); }),
            refusal("options: noise is false, now true"));
  info.text = R"({"noise": false, "vignetting": true})";
  EXPECT_EQ(error_of([&] { DatasetWriter(root, info); }),
            refusal("options: vignetting is absent, now true"));
  // Key order and spaces are no difference.
  info.text = R"({   "noise":false })";
  EXPECT_EQ(error_of([&] { DatasetWriter(root, info); }), "no error");
}

TEST(Writer, AnotherPathIsNotContinued) {
  const TemporaryFolder folder("writer_path");
  PlaneWorld world;
  world.write(folder.path() / "d");
  world.track[2].world_from_camera.translation.x() += 1e-9;
  DatasetWriter writer(folder.path() / "d", world.info());
  EXPECT_EQ(error_of([&] { writer.write_scene(world.camera, world.track, world.wall()); }),
            writer.layout().trajectory().string() +
                ": differs from this run's; choose another folder or remove it");
}

TEST(Writer, AnotherWallIsNotContinued) {
  const TemporaryFolder folder("writer_wall");
  const PlaneWorld world;
  world.write(folder.path() / "d");
  TriangleMesh wall = world.wall();
  wall.vertices[1].x() += 1e-9;
  DatasetWriter writer(folder.path() / "d", world.info());
  EXPECT_EQ(error_of([&] { writer.write_scene(world.camera, world.track, wall); }),
            writer.layout().wall().string() +
                ": differs from this run's; choose another folder or remove it");
}

TEST(Writer, AFolderOfOtherThingsIsRefused) {
  const TemporaryFolder folder("writer_foreign");
  write_atomic(folder.path() / "thesis.txt", "precious");
  EXPECT_EQ(error_of([&] { DatasetWriter(folder.path(), PlaneWorld().info()); }),
            folder.path().string() +
                ": is neither empty nor a dataset (it holds 'thesis.txt'); choose another folder");
}

TEST(Writer, AFolderThatCannotBeMadeIsNamed) {
  const TemporaryFolder folder("writer_unwritable");
  write_atomic(folder.path() / "file", "x");
  const fs::path root = folder.path() / "file" / "d";
  EXPECT_EQ(error_of([&] { DatasetWriter(root, PlaneWorld().info()); }),
            root.string() + ": output folder cannot be created: Not a directory");
}

TEST(Writer, AFullDiskNamesTheFile) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const TemporaryFolder folder("writer_full");
  const PlaneWorld world;
  DatasetWriter writer(folder.path() / "d", world.info());
  writer.write_scene(world.camera, world.track, world.wall());
  fs::create_symlink("/dev/full", temporary_for(writer.layout().flow(0)));
  EXPECT_EQ(error_of([&] { writer.write_frame(0, world.image(0), world.truth(0)); }),
            writer.layout().flow(0).string() + ": cannot be written: No space left on device");
  EXPECT_FALSE(writer.has_frame(0));
}

TEST(Writer, AFrameWithoutOneOfItsFilesIsWrittenAgain) {
  const TemporaryFolder folder("writer_lost");
  const PlaneWorld world;
  world.write(folder.path() / "d");
  const DatasetWriter writer(folder.path() / "d", world.info());
  const DatasetLayout& layout = writer.layout();
  EXPECT_TRUE(writer.has_frame(4));  // the last frame has no flow
  for (const fs::path& file :
       {layout.frame(2), layout.depth(2), layout.normals(2), layout.flow(2), layout.masks(2)}) {
    EXPECT_TRUE(writer.has_frame(2));
    const std::string bytes = read_text(file);
    fs::remove(file);
    EXPECT_FALSE(writer.has_frame(2)) << file;
    write_atomic(file, bytes);
  }
}

TEST(Writer, AFrameThatWasNotWrittenIsNamed) {
  const TemporaryFolder folder("writer_gap");
  const PlaneWorld world(3);
  const fs::path root = folder.path() / "d";
  DatasetWriter writer(root, world.info());
  writer.write_scene(world.camera, world.track, world.wall());
  writer.write_frame(0, world.image(0), world.truth(0));
  writer.write_frame(2, world.image(2), world.truth(2));
  EXPECT_EQ(error_of([&] {
              writer.finish({1, 1, 1}, {1, 1, 1});
            }),
            root.string() + ": frame 1 was not written");
  EXPECT_EQ(error_of([&] { Truth::open(root); }),
            root.string() +
                ": the dataset was not finished (no manifest.sha256); run the simulation again");
}

TEST(Writer, LabelsOfAnotherSizeAreRefused) {
  const TemporaryFolder folder("writer_size");
  const PlaneWorld world;
  DatasetWriter writer(folder.path() / "d", world.info());
  FrameTruth truth = world.truth(1);
  truth.flow_px = truth.flow_px.colRange(0, 60).clone();
  EXPECT_EQ(error_of([&] { writer.write_frame(1, world.image(1), truth); }),
            "frame 1: flow is 60 x 48 of CV_32FC2, expected 64 x 48 of CV_32FC2");
}

TEST(Writer, WithoutLabelsTheDatasetIsStillSound) {
  const TemporaryFolder folder("writer_nolabels");
  const PlaneWorld world;
  DatasetInfo info = world.info();
  info.truth.labels = LabelSet::none();
  DatasetWriter writer(folder.path() / "d", info);
  writer.write_scene(world.camera, world.track, world.wall());
  for (int i = 0; i < 5; ++i) writer.write_frame(i, world.image(i), {});
  writer.finish(std::vector<double>(5, 0.01), std::vector<double>(5, 1.0));
  EXPECT_EQ(check_dataset(folder.path() / "d").problems, std::vector<std::string>{});
  EXPECT_FALSE(fs::exists(writer.layout().depth(0).parent_path()));
}

}  // namespace
}  // namespace rugae
