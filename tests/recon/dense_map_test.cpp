// The whole dense map from frames of a bumpy cavity, at true poses.

#include "recon/dense/dense_map.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>

#include "synthetic.h"

namespace rugae {
namespace {

constexpr int kCameras = 14;

class DenseMapOfFrames : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::filesystem::temp_directory_path() / "rugae_dense_map";
    std::filesystem::remove_all(folder_);
    std::vector<Rigid3> poses;
    for (int i = 0; i < kCameras; ++i) poses.push_back(synthetic::world_from_camera(0.05 * i));
    constexpr double kNoiseLevels = 1.0;
    recording_ = synthetic::record(folder_, synthetic::lens_of(320, 240), poses, kNoiseLevels);
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder_); }

  /// True poses; points where some rays of each key frame meet the wall.
  static Structure true_structure(const Lens& lens) {
    Structure structure;
    for (int i = 0; i < kCameras; ++i) {
      structure.frames.push_back(i);
      structure.placed.push_back(true);
      structure.cam_from_world.push_back(recording_.world_from_camera[i].inverse());
    }
    for (int i = 0; i < 4000; ++i) {
      // Spread evenly over the sphere of directions (Fibonacci).
      const double z = 1.0 - (2.0 * i + 1.0) / 4000.0, turn = 2.399963229728653 * i;
      const Vec3 direction(std::sqrt(1.0 - z * z) * std::cos(turn),
                           std::sqrt(1.0 - z * z) * std::sin(turn), z);
      Track track;
      track.point = synthetic::wall_radius_mm(direction) * direction;
      track.triangulated = true;
      for (int k = 0; k < kCameras; ++k) {
        const auto pixel = lens.project(structure.cam_from_world[k] * track.point);
        if (pixel && lens.contains(*pixel)) track.observations.push_back({k, *pixel});
      }
      if (track.observations.size() >= 2) structure.tracks.push_back(track);
    }
    return structure;
  }

  static DenseMap build(std::size_t threads, double wrong_rad = 0.0) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    PreprocessOptions preprocess;
    preprocess.devignette = false;
    const FrameSource frames(Observations::open(recording_.images, recording_.calibration),
                             preprocess);
    Structure structure = true_structure(frames.lens());
    for (int k = 0; k < kCameras; ++k)
      structure.cam_from_world[k] =
          Rigid3(Quat(Eigen::AngleAxisd(k % 2 == 0 ? wrong_rad : -wrong_rad,
                                        Vec3(1.0, k % 3 - 1.0, 0.2).normalized())),
                 Vec3::Zero()) *
          structure.cam_from_world[k];
    DenseOptions options;
    options.width_px = 200;
    options.max_depth_maps = 6;
    options.depth_maps_a_point = 4;
    Progress progress(Progress::Output::silent);
    return build_dense_map(frames, structure, {}, preprocess.reflections, options, 2, progress);
  }

  static inline std::filesystem::path folder_;
  static inline synthetic::Recording recording_;
};

TEST_F(DenseMapOfFrames, IsTheWallAndTheSameForAnyNumberOfThreads) {
  const DenseMap map = build(1);
  EXPECT_EQ(map.depth_maps, 6);
  ASSERT_EQ(map.examples.size(), 2u);
  EXPECT_LT(map.examples[0].frame, map.examples[1].frame);
  EXPECT_EQ(map.examples[0].picture.size(), map.examples[0].agreed.size());
  const cv::Mat found = map.examples[0].found > 0.0f, agreed = map.examples[0].agreed > 0.0f;
  EXPECT_GT(cv::countNonZero(found & ~agreed), 0);  // what no other depth map has
  EXPECT_GT(cv::countNonZero(agreed & ~found), 0);  // gaps
  ASSERT_GE(map.mesh.vertices.size(), 1000u);
  ASSERT_EQ(map.mesh.colors.size(), map.mesh.vertices.size());
  ASSERT_EQ(map.mesh.normals.size(), map.mesh.vertices.size());
  ASSERT_EQ(map.mesh.sigma.size(), map.mesh.vertices.size());
  std::vector<double> errors;
  int outward = 0;
  for (std::size_t v = 0; v < map.mesh.sigma.size(); ++v) {
    const Vec3& p = map.mesh.vertices[v];
    errors.push_back(std::abs(p.norm() - synthetic::wall_radius_mm(p.normalized())));
    outward += map.mesh.normals[v].cast<double>().dot(p) > 0.0 ? 1 : 0;
  }
  std::ranges::sort(errors);
  // The wall is some 40 mm off: a quarter of a percent.
  EXPECT_LE(errors[errors.size() / 2], 0.1);
  EXPECT_LE(errors[errors.size() * 9 / 10], 0.4);
  EXPECT_GE(outward, 0.99 * static_cast<double>(map.mesh.sigma.size()));

  const DenseMap again = build(2);
  ASSERT_EQ(again.mesh.vertices.size(), map.mesh.vertices.size());
  for (std::size_t v = 0; v < map.mesh.sigma.size(); ++v) {
    ASSERT_TRUE(again.mesh.vertices[v] == map.mesh.vertices[v]);
    ASSERT_TRUE(again.mesh.colors[v] == map.mesh.colors[v]);
    ASSERT_TRUE(again.mesh.sigma[v] == map.mesh.sigma[v]);
  }
  ASSERT_TRUE(again.mesh.triangles == map.mesh.triangles);
}

TEST_F(DenseMapOfFrames, WrongPosesLeaveNextToNothing) {
  constexpr double kWrongRad = 0.06;  // 7 px of 200
  EXPECT_LE(build(2, kWrongRad).depth_share, 0.05);
}

TEST_F(DenseMapOfFrames, NothingPlacedIsAnEmptyMap) {
  const FrameSource frames(Observations::open(recording_.images, recording_.calibration), {});
  Progress progress(Progress::Output::silent);
  const DenseMap map = build_dense_map(frames, Structure{}, {}, {}, DenseOptions{}, 2, progress);
  EXPECT_TRUE(map.mesh.empty());
  EXPECT_EQ(map.depth_maps, 0);
}

}  // namespace
}  // namespace rugae
