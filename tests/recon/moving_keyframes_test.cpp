// A structure from frames whose rows were read one after another.

#include "recon/dense/moving_keyframes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "core/files.h"
#include "recon/dense/dense_map.h"
#include "recon/dense/frame_poses.h"
#include "recon/dense/linked_structure.h"
#include "recon/dense/revisits.h"
#include "synthetic.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

class MovingKeyframes : public testing::Test {
 protected:
  static constexpr int kCameras = 12, kWidth = 320, kHeight = 240;
  static synthetic::Options path(double noise_px) {
    return {.cameras = kCameras,
            .step_rad = 0.1,
            .width = kWidth,
            .points = 2500,
            .max_run = 6,
            .readout_share = 0.9,
            .noise_px = noise_px};
  }

  static void SetUpTestSuite() {
    root_ = fs::path(testing::TempDir()) / fmt::format("rugae_moving_{}", getpid());
    fs::remove_all(root_);
    std::vector<RowPoses> rows;
    for (int k = 0; k < kCameras; ++k) rows.push_back(synthetic::rows_of(path(0.0), k));
    recording_ = synthetic::record(root_, synthetic::lens_of(kWidth, kHeight), rows, 1.0);
    write_atomic(root_ / "global.yaml",
                 lens_yaml(synthetic::lens_of(kWidth, kHeight), "test") + "row_time_us: 0\n");
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  static FrameSource frames(bool known = true) {
    PreprocessOptions options;
    options.devignette = false;
    return {Observations::open(recording_.images,
                               known ? recording_.calibration : root_ / "global.yaml"),
            options};
  }
  static synthetic::World world(double noise_px) {
    synthetic::World world = synthetic::make_world(path(noise_px));
    for (int first = 2; first + 2 < kCameras; first += 2) {
      synthetic::Options later = path(noise_px);
      later.first_camera = first;
      later.seed = static_cast<std::uint64_t>(first);
      const synthetic::World more = synthetic::make_world(later);
      world.tracks.insert(world.tracks.end(), more.tracks.begin(), more.tracks.end());
    }
    return world;
  }
  static Structure chain_of(const synthetic::World& world) {
    Progress progress(Progress::Output::silent);
    return build_structure(world.frames, world.tracks, world.lens, BundleOptions{},
                           kFinalAdjustment, progress);
  }
  /// Poses and points as they are, rays as they were seen.
  static Structure truth() {
    Structure s;
    const synthetic::World own = synthetic::make_world(path(0.0));
    s.frames = own.frames;
    s.placed.assign(kCameras, true);
    s.cam_from_world = own.cam_from_world;
    s.tracks = own.tracks;
    for (std::size_t t = 0; t < s.tracks.size(); ++t) {
      s.tracks[t].point = own.points[t];
      s.tracks[t].triangulated = true;
    }
    return s;
  }
  static Structure linked(bool known) {
    Progress progress(Progress::Output::silent);
    Structure structure = chain_of(world(0.3));
    link_revisits(frames(known), RevisitOptions{}, BundleOptions{}, structure, progress);
    return structure;
  }

  static inline fs::path root_;
  static inline synthetic::Recording recording_;
};

// Exact tracks: what is left is what parabolas through three key frames leave of how the camera
// moves, a twentieth of what the shutter does to the path.
TEST_F(MovingKeyframes, ExactTracksGiveTheirPath) {
  constexpr double kLeftShare = 0.05;
  const synthetic::World exact = world(0.0);
  Structure s = chain_of(exact);
  ASSERT_EQ(s.placed_count(), kCameras);
  const auto before = synthetic::path_error(s, exact);
  Progress progress(Progress::Output::silent);
  for (int round = 0; round < 4; ++round)
    finish_moving(frames(), BundleOptions{}, kFinalAdjustment, s, progress);
  const auto after = synthetic::path_error(s, exact);
  std::printf("path error %.4f mm as if global, %.4f mm rolling\n", before.rmse, after.rmse);
  EXPECT_GE(before.rmse, 0.2);  // there is something to take out
  EXPECT_LE(after.rmse, kLeftShare * before.rmse);
  EXPECT_LE(after.worst_rotation_rad, kLeftShare * before.worst_rotation_rad);
}

// Where rows are read at once nothing is set anew.
TEST_F(MovingKeyframes, AGlobalShutterIsFinishedOnce) {
  const synthetic::World exact = world(0.0);
  const Structure chain = chain_of(exact);
  Structure moving = chain, plain = chain;
  Progress progress(Progress::Output::silent);
  finish_moving(frames(false), BundleOptions{}, kFinalAdjustment, moving, progress);
  finish_structure(plain, exact.lens, BundleOptions{}, kFinalAdjustment, progress);
  for (int k = 0; k < kCameras; ++k)
    EXPECT_EQ(moving.cam_from_world[k].translation, plain.cam_from_world[k].translation);
}

// Patches looked for in pictures, from noisy tracks; frames between; and the wall at their poses.
TEST_F(MovingKeyframes, PathFramesAndWallOfPictures) {
  const synthetic::World truth = world(0.3);
  const Structure s = linked(true);
  ASSERT_EQ(s.placed_count(), kCameras);
  const double as_global = synthetic::path_error(linked(false), truth).rmse;
  const double rolling = synthetic::path_error(s, truth).rmse;
  std::printf("path error %.4f mm as if global, %.4f mm rolling\n", as_global, rolling);
  EXPECT_LE(rolling, 0.25 * as_global);

  const Structure half = synthetic::every_other_keyframe(s);
  Progress progress(Progress::Output::silent);
  const FrameSource source = frames();
  const auto poses = place_frames(source, half, make_patches(source, half), {}, progress);
  std::vector<Rigid3> estimated;
  for (const auto& pose : poses) {
    ASSERT_TRUE(pose.has_value());
    estimated.push_back(pose->inverse());
  }
  const double between = synthetic::path_error(estimated, recording_.world_from_camera).rmse;
  std::printf("frames between %.4f mm\n", between);
  EXPECT_LE(between, 0.1 * as_global);  // 0.17 before the frames beside are known
}

// Without revisits the camera moves while rows are read all the same.
TEST_F(MovingKeyframes, TheShutterIsKnownWithoutRevisitsToo) {
  const synthetic::World exact = world(0.0);
  const auto error_mm = [&](bool known) {
    Progress progress(Progress::Output::silent);
    RevisitOptions none;
    none.rounds = 0;
    return synthetic::path_error(build_linked_structure(frames(known), exact.frames, exact.tracks,
                                                        none, BundleOptions{}, progress),
                                 exact)
        .rmse;
  };
  const double rolling = error_mm(true), as_global = error_mm(false);
  std::printf("path error %.4f mm as if global, %.4f mm rolling\n", as_global, rolling);
  EXPECT_LE(rolling, 0.25 * as_global);
}

// In its own anchor a patch is as it was cut out, rows read at other times and all; elsewhere what
// is found agrees on where the key frame stands.
TEST_F(MovingKeyframes, PatchesAreForetoldAndAgreed) {
  Structure s = truth();
  const FrameSource source = frames();
  set_rays_at_frame_time(source, s);
  const auto patches = make_patches(source, s);
  ASSERT_GE(patches.size(), s.tracks.size() / 4);
  const auto motions = keyframe_motions(source, s);
  double worst = 0.0;
  for (const WallPatch& patch : patches) {
    const auto sight =
        foretell(patch, {s.cam_from_world[patch.anchor], motions[patch.anchor]}, source.shutter());
    ASSERT_TRUE(sight.has_value());
    worst = std::max(worst, (sight->linear - Mat2::Identity()).norm());
  }
  // A slanted plane bends within the two pixels of the difference; rows taken for read at once are
  // off by 0.36.
  EXPECT_LE(worst, 0.05);

  Progress progress(Progress::Output::silent);
  const RevisitReport report = observe_again(source, patches, {}, {}, s, progress);
  std::printf("worst %.4f, %zu found, %zu accepted\n", worst, report.found, report.accepted);
  EXPECT_GE(report.found, 200u);
  EXPECT_GE(static_cast<double>(report.accepted), 0.9 * static_cast<double>(report.found));
}

// At true poses: rows that are taken for read at once put the wall elsewhere.
TEST_F(MovingKeyframes, TheWallIsWhereItIs) {
  const auto median_error_mm = [&](bool known) {
    const Structure s = truth();
    DenseOptions options;
    options.width_px = 200;
    options.max_depth_maps = 6;
    options.depth_maps_a_point = 4;
    Progress progress(Progress::Output::silent);
    const FrameSource source = frames(known);
    const DenseMap map = build_dense_map(
        source, s, known ? keyframe_motions(source, s) : std::vector<CameraMotion>(),
        PreprocessOptions{}.reflections, options, 0, progress);
    std::vector<double> errors;
    for (const Vec3& p : map.mesh.vertices)
      errors.push_back(std::abs(p.norm() - synthetic::wall_radius_mm(p.normalized())));
    if (errors.size() < 500) return 1e9;
    std::ranges::nth_element(errors, errors.begin() + static_cast<long>(errors.size() / 2));
    return errors[errors.size() / 2];
  };
  const double rolling = median_error_mm(true), as_global = median_error_mm(false);
  std::printf("wall off by %.3f mm as if global, %.3f mm rolling\n", as_global, rolling);
  EXPECT_LE(rolling, 0.12);  // as good as with a global shutter (DenseMapOfFrames)
  EXPECT_GE(as_global, 2.0 * rolling);
}

}  // namespace
}  // namespace rugae
