#include "validate/evaluate.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "dataset/image_io.h"
#include "tests/message_of.h"
#include "tests/studies/in_temporary_folder.h"
#include "tests/studies/inside_sphere.h"
#include "validate/wall_seen.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Meshes are written as 32-bit floats by some writers: 1e-6 of their size.
constexpr double kStored_mm = 1e-3;
// The facets lie inside the sphere: 41 mm (1 - cos(pi / (40 sqrt 2))).
constexpr double kFacets_mm = 0.07;

class Evaluate : public InTemporaryFolder {
 protected:
  json metrics(double units_per_mm, double radius_mm = inside_sphere::kRadius_mm) {
    inside_sphere::write_dataset(folder_ / "data");
    inside_sphere::write_estimate_of_truth(folder_ / "estimate", units_per_mm, radius_mm);
    Progress progress(Progress::Output::silent);
    return evaluate(folder_ / "data", folder_ / "estimate", progress);
  }
};

TEST_F(Evaluate, TheTruthInAnotherWorldHasNoErrorButItsLostFrame) {
  const json m = metrics(0.05);
  const json& path = m.at("trajectory");
  EXPECT_TRUE(path.at("ate_sim3_rmse_mm").get<double>() <= 1e-9);
  EXPECT_NEAR(path.at("scale_mm_per_unit").get<double>(), 20.0, 1e-9);
  EXPECT_TRUE(path.at("ate_se3_rmse_mm").get<double>() > 1.0);
  EXPECT_EQ(path.at("note"), "");
  EXPECT_EQ(m.at("tracking").at("tracked"), 11);
  EXPECT_EQ(m.at("tracking").at("lost"), 1);
  EXPECT_EQ(m.at("tracking").at("keyframes"), 4);
  EXPECT_TRUE(m.at("depth").at("sim3").at("abs_rel").get<double>() <= 1e-6);
  EXPECT_EQ(m.at("depth").at("sim3").at("frames"), 4);
  EXPECT_EQ(m.at("depth").at("sim3").at("valid_share"), 1.0);
  const json& surface = m.at("surface").at("trajectory_aligned");
  EXPECT_TRUE(surface.at("completeness_max_mm").get<double>() <= kStored_mm);
  EXPECT_EQ(surface.at("recall_at_0.25mm"), 1.0);
  EXPECT_EQ(m.at("time").at("reconstruct_s"), 2.0);
  EXPECT_EQ(m.at("time").at("frames_per_s"), 6.0);
  EXPECT_EQ(m.at("time").at("path_s"), 1.5);
  EXPECT_EQ(m.at("time").at("path_frames_per_s"), 8.0);
  EXPECT_EQ(m.at("time").at("stage_s").at("adjustment"), 1.5);  // both
  EXPECT_EQ(m.at("time").at("peak_rss_mb"), 200.0);

  const json& frames = m.at("frames");  // for plots: gaps where frames were lost
  ASSERT_EQ(frames.at("time_s").size(), static_cast<std::size_t>(inside_sphere::kFrames));
  EXPECT_TRUE(frames.at("position_error_mm")[5].is_null());
  EXPECT_TRUE(frames.at("estimate_mm")[5].is_null());
  EXPECT_EQ(frames.at("state")[5], "lost");
  for (int i = 0; i < inside_sphere::kFrames; ++i) {
    if (i == 5) continue;
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(frames.at("estimate_mm")[i][k].get<double>(),
                  frames.at("truth_mm")[i][k].get<double>(), 1e-9);
  }
}

TEST_F(Evaluate, AMapOneMillimetreTooLargeIsOneMillimetreOff) {
  const json m = metrics(1.0, inside_sphere::kRadius_mm + 1.0);
  const json& surface = m.at("surface").at("trajectory_aligned");
  EXPECT_NEAR(surface.at("completeness_mean_mm").get<double>(), 1.0, kFacets_mm);
  EXPECT_EQ(surface.at("f_at_0.5mm"), 0.0);
  EXPECT_EQ(surface.at("recall_at_2mm"), 1.0);
}

// Without depth nobody knows what was seen of the wall; the path is measured all the same.
TEST_F(Evaluate, ADatasetWithoutDepthHasItsPathMeasured) {
  const json whole = metrics(0.05);
  inside_sphere::write_dataset(folder_ / "bare", {.labelled = false});
  Progress progress(Progress::Output::silent);
  const json bare = evaluate(folder_ / "bare", folder_ / "estimate", progress);
  EXPECT_EQ(bare.at("trajectory"), whole.at("trajectory"));
  EXPECT_EQ(bare.at("tracking"), whole.at("tracking"));
  EXPECT_EQ(bare.at("time"), whole.at("time"));
  EXPECT_TRUE(bare.at("depth").at("sim3").is_null());
  EXPECT_TRUE(bare.at("coverage").is_null());
  EXPECT_TRUE(bare.at("surface").at("trajectory_aligned").is_null());
  EXPECT_EQ(bare.at("surface").at("note"), "the dataset was made without depth");
}

// A wall that went elsewhere with the camera: as much of it is seen, and the map is where it was.
TEST_F(Evaluate, AWallThatMovedIsMeasuredWhereItWas) {
  const json still = metrics(0.05);
  inside_sphere::write_dataset(folder_ / "moved", {.moved_mm = {20.0f, -15.0f, 5.0f}});
  Progress progress(Progress::Output::silent);
  const json moved = evaluate(folder_ / "moved", folder_ / "estimate", progress);
  EXPECT_EQ(moved.at("coverage"), still.at("coverage"));
  const json& surface = moved.at("surface").at("trajectory_aligned");
  EXPECT_TRUE(surface.at("completeness_max_mm").get<double>() <= kStored_mm);
  EXPECT_EQ(surface.at("recall_at_0.25mm"), 1.0);
}

// A file that an earlier estimate of other key frames left is not this one's.
TEST_F(Evaluate, DepthIsThatOfKeyFrames) {
  const json before = metrics(0.05);
  write_exr(EstimateLayout{folder_ / "estimate"}.depth(1),
            cv::Mat(inside_sphere::kHeight, inside_sphere::kWidth, CV_32F, cv::Scalar(1.0)));
  Progress progress(Progress::Output::silent);
  EXPECT_EQ(evaluate(folder_ / "data", folder_ / "estimate", progress).at("depth"),
            before.at("depth"));
}

// Each frame by its own depth, whatever was read beside it.
TEST_F(Evaluate, TheWallSeenIsThatOfEachFramesOwnDepth) {
  inside_sphere::write_dataset(folder_ / "data");
  const Truth truth = Truth::open(folder_ / "data");
  Visibility one_by_one(truth.wall(), {});
  std::vector<int> backwards;
  for (int i = truth.size() - 1; i >= 0; --i) {
    one_by_one.add(truth.camera().lens, truth.row_poses(i), truth.depth_mm(i));
    backwards.push_back(i);
  }
  Progress progress(Progress::Output::silent);
  EXPECT_EQ(wall_seen(truth, backwards, progress).seen(), one_by_one.seen());
}

// The files of an estimate, without what says that they are one.
TEST_F(Evaluate, TheSameFilesFromAnotherProgramHaveTheSameErrors) {
  const json ours = metrics(0.05, inside_sphere::kRadius_mm + 1.0);
  const EstimateLayout layout{folder_ / "estimate"};
  const EstimateFiles files{layout.trajectory(), layout.map_ply(), layout.depth_folder(), 20.0};
  Progress progress(Progress::Output::silent);
  const json theirs = evaluate(folder_ / "data", files, progress);
  const auto expect_near = [](const json& a, const json& b) {
    ASSERT_EQ(a.size(), b.size());
    for (const auto& [key, value] : a.items()) {
      if (!value.is_number()) continue;
      const double expected = value.get<double>();
      EXPECT_NEAR(b.at(key).get<double>(), expected, 1e-6 * std::max(1.0, std::abs(expected)))
          << key;
    }
  };
  EXPECT_EQ(theirs.at("tracking").at("lost"), 1);
  EXPECT_NEAR(theirs.at("trajectory").at("scale_mm_per_unit").get<double>(), 1.0, 1e-9);
  EXPECT_TRUE(theirs.at("trajectory").at("ate_se3_rmse_mm").get<double>() <= 1e-9);  // in mm now
  expect_near(ours.at("surface").at("trajectory_aligned"),
              theirs.at("surface").at("trajectory_aligned"));
  expect_near(ours.at("depth").at("sim3"), theirs.at("depth").at("sim3"));
  expect_near(ours.at("depth").at("median_scaled"), theirs.at("depth").at("median_scaled"));
  EXPECT_TRUE(theirs.at("depth").at("as_given").at("abs_rel").get<double>() <= 1e-6);
  EXPECT_EQ(theirs.at("depth").at("as_given").at("frames"), 4);
  EXPECT_FALSE(ours.at("depth").contains("as_given"));
  EXPECT_TRUE(theirs.at("time").at("reconstruct_s").is_null());
  // In whatever unit: the trajectory's is the depth's.
  const json unscaled = evaluate(
      folder_ / "data", EstimateFiles{layout.trajectory(), {}, layout.depth_folder()}, progress);
  expect_near(ours.at("depth").at("sim3"), unscaled.at("depth").at("sim3"));
}

TEST_F(Evaluate, DepthAloneIsMeasuredAndSoIsItsScale) {
  metrics(1.0);
  const fs::path depth = folder_ / "predicted";
  make_folder(depth);
  const Truth truth = Truth::open(folder_ / "data");
  for (const int frame : {2, 7}) {  // half a step is 0.005 mm of 20 mm and more
    cv::Mat hundredths;
    truth.depth_mm(frame).convertTo(hundredths, CV_16U, 100.0 * 1.1);
    write_image(depth / fmt::format("frame_{}.png", frame), hundredths);
  }
  Progress progress(Progress::Output::silent);
  const json m =
      evaluate(folder_ / "data", EstimateFiles{.depth = depth, .depth_scale = 0.01}, progress);
  EXPECT_NEAR(m.at("depth").at("as_given").at("abs_rel").get<double>(), 0.1, 1e-3);
  EXPECT_TRUE(m.at("depth").at("median_scaled").at("abs_rel").get<double>() <= 1e-3);
  EXPECT_TRUE(m.at("depth").at("sim3").is_null());
  EXPECT_EQ(m.at("depth").at("as_given").at("frames"), 2);
  EXPECT_EQ(m.at("tracking").at("tracked"), 0);
  EXPECT_EQ(m.at("surface").at("note"), "the estimate has no map");
}

TEST_F(Evaluate, EstimateFilesThatDoNotFitAreNamed) {
  metrics(1.0);
  Progress progress(Progress::Output::silent);
  const auto refused = [&](const EstimateFiles& files) {
    return message_of([&] { evaluate(folder_ / "data", files, progress); });
  };
  const std::string trajectory = (folder_ / "estimate" / "trajectory.txt").string();
  const fs::path depth = folder_ / "predicted";
  make_folder(depth);
  EXPECT_EQ(refused({.depth = depth}), depth.string() + ": no files .exr, .png in this folder");
  write_exr(depth / "a12.exr", cv::Mat(4, 4, CV_32F, cv::Scalar(1.0)));
  EXPECT_EQ(refused({.depth = depth}),
            (depth / "a12.exr").string() + ": frame 12, the dataset has 0 to 11");
  fs::rename(depth / "a12.exr", depth / "a3.exr");
  EXPECT_EQ(refused({.depth = depth}),
            depth.string() + ": depth of frame 3 is 4 x 4, the frames are 96 x 72");
  fs::rename(depth / "a3.exr", depth / "a3_16bit.exr");
  EXPECT_EQ(refused({.depth = depth}),
            (depth / "a3_16bit.exr").string() + ": expected one number in the name, its frame's");
  inside_sphere::write_dataset(folder_ / "bare", {.labelled = false});
  EXPECT_EQ(
      message_of([&] { evaluate(folder_ / "bare", EstimateFiles{.depth = depth}, progress); }),
      (folder_ / "bare").string() + ": made without depth, there is nothing to measure " +
          depth.string() + " against");
  EXPECT_EQ(refused({.trajectory = trajectory, .mm_per_unit = -1.0}),
            "mm-per-unit is -1, expected above 0");
  EXPECT_EQ(refused({.trajectory = folder_ / "estimate", .mm_per_unit = 20.0}),
            (folder_ / "estimate").string() +
                ": an estimate has its own map, depth and unit; others' go with a trajectory");
  EXPECT_EQ(refused({.map = "map.ply", .depth = depth}),
            "map.ply: a map is placed by the trajectory, which is missing");
  write_atomic(folder_ / "late.txt", "0.02 0 0 0 0 0 0 1\n");
  EXPECT_EQ(refused({.trajectory = folder_ / "late.txt"}),
            (folder_ / "late.txt").string() +
                ": a pose at 0.02 s, expected the times of frames to within 0.0017 s, the nearest "
                "is 0.03333333333333333 s");
}

TEST_F(Evaluate, AnEstimateOfOtherFramesIsAnError) {
  inside_sphere::write_dataset(folder_ / "data");
  inside_sphere::write_estimate_of_truth(folder_ / "estimate", 1.0);
  const EstimateLayout layout{folder_ / "estimate"};
  Estimate estimate = read_estimate(layout.root);
  for (double& t : estimate.times_s) t += 1.0;
  write_estimate(layout.root, estimate);
  Progress progress(Progress::Output::silent);
  EXPECT_THROW(evaluate(folder_ / "data", layout.root, progress), Error);
}

}  // namespace
}  // namespace rugae
