#pragma once
// A small world in a folder of its own, and datasets made of it.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "core/pose_track.h"
#include "dataset/ply_io.h"
#include "render/simulate.h"
#include "tests/render/walls.h"

namespace rugae {

namespace fs = std::filesystem;

// A small world in a folder of its own: a bumpy cavity, a camera, a track of seven poses.
class Simulate : public testing::Test {
 protected:
  void SetUp() override {
    // A process started by a death test works in the folder of the one that started it.
    const char* given = std::getenv("RUGAE_SIMULATE_TEST");
    root_ = given ? fs::path(given)
                  : fs::temp_directory_path() / fmt::format("rugae_simulate_{}", getpid());
    setenv("RUGAE_SIMULATE_TEST", root_.c_str(), 1);
    fs::remove_all(root_);
    make_folder(root_);
    write_ply(root_ / "wall.ply", test::sphere_mesh(3, 60.0, [](const Vec3& d) {
                return 1.0 + 0.1 * std::sin(5.0 * d.x()) * std::cos(4.0 * d.y());
              }));
    write_atomic(root_ / "scene.yaml",
                 "kind: mesh\nmesh: wall.ply\ntarget_edge_mm: 4\nwith_relief: false\n");
    write_atomic(root_ / "camera.yaml",
                 "name: small\nframes_in_paper: 6\ndiameter_mm: 4\n"
                 "lens: {model: brown_conrady, width: 64, height: 48, horizontal_fov_deg: 90, "
                 "k1: -0.1}\n"
                 "vignetting: {cos4: true}\n"
                 "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 9000, "
                 "read_noise_e: 5, shutter: global}\n");
    PoseTrack track;
    for (int i = 0; i < 7; ++i)
      track.push_back({i / 30.0, Rigid3(Quat(Eigen::AngleAxisd(0.05 * i, Vec3::UnitY())),
                                        Vec3(3.0 * i - 9.0, 0.7 * i * i - 10.0, 1.5 * i))});
    write_atomic(root_ / "track.txt", tum_text(track));
    write_atomic(root_ / "path.yaml", "file: track.txt\nclearance_mm: 5\n");
    options_.scene = (root_ / "scene.yaml").string();
    options_.camera = (root_ / "camera.yaml").string();
    options_.trajectory = (root_ / "path.yaml").string();
    options_.resolution = "coarse";
  }
  void TearDown() override {
    fs::remove_all(root_);
    unsetenv("RUGAE_SIMULATE_TEST");
  }

  SimulateResult run(const std::string& folder, const SimulateOptions& options) {
    Progress progress(Progress::Output::silent);
    return simulate(options, root_ / folder, progress);
  }
  SimulateResult run(const std::string& folder) { return run(folder, options_); }

  // Every file below the folder, by its bytes.
  std::map<std::string, std::string> contents(const std::string& folder) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(root_ / folder))
      if (entry.is_regular_file())
        files[fs::relative(entry.path(), root_ / folder).string()] = read_text(entry.path());
    return files;
  }
  void expect_same(const std::string& a, const std::string& b) const {
    const auto in_a = contents(a), in_b = contents(b);
    EXPECT_GT(in_a.size(), 10u);
    for (const auto& [file, bytes] : in_a) {
      ASSERT_TRUE(in_b.contains(file)) << file;
      EXPECT_TRUE(in_b.at(file) == bytes) << file;
    }
    EXPECT_EQ(in_a.size(), in_b.size());
  }

  fs::path root_;
  SimulateOptions options_;
};

}  // namespace rugae
