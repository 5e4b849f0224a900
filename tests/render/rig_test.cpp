// Several cameras on one capsule: their datasets belong together.
#include "cameras/rig.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "dataset/check_dataset.h"
#include "dataset/truth.h"
#include "render/simulate.h"
#include "tests/message_of.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;

class RigDatasets : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / fmt::format("rugae_rigs_{}", getpid());
    fs::remove_all(root_);
    make_folder(root_);
    write_ply(root_ / "wall.ply", test::sphere_mesh(4, 60.0, [](const Vec3& d) {
                return 1.0 + 0.05 * std::sin(4.0 * d.x()) * std::cos(3.0 * d.y());
              }));
    write_atomic(root_ / "scene.yaml",
                 "kind: mesh\nmesh: wall.ply\ntarget_edge_mm: 4\nwith_relief: false\n");
    write_atomic(root_ / "small.yaml",
                 "name: small\nframes_in_paper: 6\ndiameter_mm: 4\n"
                 "lens: {model: brown_conrady, width: 64, height: 48, horizontal_fov_deg: 90, "
                 "k1: -0.1}\n"
                 "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 9000, "
                 "read_noise_e: 5, shutter: global}\n");
    write_atomic(root_ / "pair.yaml",
                 "kind: rig\ncameras:\n"
                 "  - {name: left, camera: small.yaml, position_mm: [-2, 0, 0]}\n"
                 "  - {name: right, camera: small.yaml, position_mm: [2, 0, 1], forward: [0.1, 0, "
                 "1], right: [1, 0, -0.1]}\n");
    PoseTrack track;
    for (int i = 0; i < 3; ++i)
      track.push_back(
          {i / 30.0, Rigid3(Quat(Eigen::AngleAxisd(0.2 * i, Vec3(1, 2, 0).normalized())),
                            Vec3(3.0 * i - 3.0, 2.0, 1.5 * i))});
    write_atomic(root_ / "track.txt", tum_text(track));
    write_atomic(root_ / "path.yaml", "file: track.txt\nclearance_mm: 5\n");
    options_.scene = (root_ / "scene.yaml").string();
    options_.camera = (root_ / "pair.yaml").string();
    options_.trajectory = (root_ / "path.yaml").string();
    options_.resolution = "coarse";
  }
  void TearDown() override { fs::remove_all(root_); }
  SimulateResult run() {
    Progress progress(Progress::Output::silent);
    return simulate(options_, root_ / "out", progress);
  }

  fs::path root_;
  SimulateOptions options_;
};

// A planned path keeps as clear as the widest of them needs.
TEST_F(RigDatasets, CamerasOfOtherSizesFlyTheSamePath) {
  std::string big = read_text(root_ / "small.yaml");
  big.replace(big.find("diameter_mm: 4"), 14, "diameter_mm: 13");
  write_atomic(root_ / "big.yaml", big);
  write_atomic(root_ / "unlike.yaml",
               "kind: rig\ncameras:\n"
               "  - {name: left, camera: small.yaml}\n"
               "  - {name: right, camera: big.yaml, position_mm: [2, 0, 1]}\n");
  write_atomic(root_ / "planned.yaml", "like: '1'\nlength_cm: 8\npasses: 1\nclearance_mm: 4\n");
  options_.scene = "stomach";
  options_.camera = (root_ / "unlike.yaml").string();
  options_.trajectory = (root_ / "planned.yaml").string();
  options_.frames = 2;
  options_.render.labels = false;
  run();
  const Rig rig = load_rig(options_.camera);
  const Truth left = Truth::open(root_ / "out" / "left"),
              right = Truth::open(root_ / "out" / "right");
  for (int i = 0; i < left.size(); ++i) {
    const Rigid3 expected = left.track()[i].world_from_camera * rig.cameras[1].capsule_from_camera;
    EXPECT_LE((expected.translation - right.track()[i].world_from_camera.translation).norm(), 1e-9);
  }
}

TEST_F(RigDatasets, PosesKeepToTheCapsule) {
  EXPECT_EQ(run().frames, 6);
  const Rig rig = load_rig(options_.camera);
  EXPECT_EQ(read_text(root_ / "out" / "rig.json"), rig_json(rig));
  const Truth left = Truth::open(root_ / "out" / "left"),
              right = Truth::open(root_ / "out" / "right");
  const PoseTrack capsule = read_tum(root_ / "track.txt");
  ASSERT_EQ(left.size(), 3);
  ASSERT_EQ(right.size(), 3);
  const Rigid3 left_from_right =
      rig.cameras[0].capsule_from_camera.inverse() * rig.cameras[1].capsule_from_camera;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(left.track()[i].time_s, right.track()[i].time_s);
    const Rigid3& a = left.track()[i].world_from_camera;
    const Rigid3& b = right.track()[i].world_from_camera;
    const Rigid3 relative = a.inverse() * b;
    EXPECT_TRUE((relative.translation - left_from_right.translation).norm() <= 1e-9);
    EXPECT_TRUE(angle_between_rad(relative.rotation, left_from_right.rotation) <= 1e-7);
    const Rigid3 expected = capsule[i].world_from_camera * rig.cameras[0].capsule_from_camera;
    EXPECT_TRUE((a.translation - expected.translation).norm() <= 1e-9);
  }
  EXPECT_EQ(check_dataset(root_ / "out" / "left").problems, std::vector<std::string>{});
  EXPECT_EQ(check_dataset(root_ / "out" / "right").problems, std::vector<std::string>{});
  EXPECT_EQ(right.camera().lights.size(), 2u);
  // The pair draws noise of its own each, and a second run finds all of it finished.
  EXPECT_EQ(run().skipped, 6);
}

// A pixel of the left frame, taken into space by its depth and into the right camera by the poses,
// has the depth that the right frame says there (read between four pixels).
TEST_F(RigDatasets, DepthAndPoseOfAPairAgree) {
  run();
  const Truth left = Truth::open(root_ / "out" / "left"),
              right = Truth::open(root_ / "out" / "right");
  const LensProjector lens(left.camera().lens);
  std::vector<double> errors_mm;
  for (int i = 0; i < 3; ++i) {
    const cv::Mat from = left.depth_mm(i), to = right.depth_mm(i);
    const auto frame = static_cast<std::size_t>(i);
    const Rigid3 right_from_left =
        right.track()[frame].world_from_camera.inverse() * left.track()[frame].world_from_camera;
    for (int y = 0; y < from.rows; ++y)
      for (int x = 0; x < from.cols; ++x) {
        const auto ray = lens.unproject({x + 0.5, y + 0.5});
        const Vec3 p = right_from_left * Vec3(*ray * (from.at<float>(y, x) / ray->z()));
        const auto at = lens.project(p);
        if (!at || at->x() < 0.5 || at->y() < 0.5 || at->x() >= to.cols - 0.5 ||
            at->y() >= to.rows - 0.5)
          continue;
        const int c = static_cast<int>(at->x() - 0.5), r = static_cast<int>(at->y() - 0.5);
        const double u = at->x() - 0.5 - c, v = at->y() - 0.5 - r;
        const double seen = (1 - v) * ((1 - u) * to.at<float>(r, c) + u * to.at<float>(r, c + 1)) +
                            v * ((1 - u) * to.at<float>(r + 1, c) + u * to.at<float>(r + 1, c + 1));
        errors_mm.push_back(std::abs(seen - p.z()));
      }
  }
  ASSERT_GT(errors_mm.size(), 6000u);
  std::ranges::sort(errors_mm);
  // Curvature between pixels 2 mm apart on a wall of 60 mm radius: 2^2 / (8 60) = 8 um, and the
  // kinks between facets of 4 mm some times that. A pose off by 0.1 mm would show.
  EXPECT_TRUE(errors_mm[errors_mm.size() / 2] <= 0.02) << errors_mm[errors_mm.size() / 2];
  EXPECT_TRUE(errors_mm.back() <= 0.5) << errors_mm.back();
}

TEST_F(RigDatasets, AnotherRigInTheFolderIsRefused) {
  run();
  write_atomic(
      root_ / "pair.yaml",
      "kind: rig\ncameras:\n  - {name: left, camera: small.yaml, position_mm: [-3, 0, 0]}\n");
  const std::string file = (root_ / "out" / "rig.json").string();
  EXPECT_EQ(message_of([&] { run(); }),
            file + ": differs from this run's; choose another folder or remove it");
}

}  // namespace
}  // namespace rugae
