#include "dataset/estimate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/files.h"
#include "core/mesh_io.h"
#include "dataset/ply_io.h"
#include "tests/dataset/plane_dataset.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;
using testing::error_of;
using testing::PlaneWorld;
using testing::TemporaryFolder;

Estimate example() {
  const PlaneWorld world;
  Estimate estimate;
  estimate.method = "paper";
  for (const TimedPose& pose : world.track) {
    estimate.times_s.push_back(pose.time_s);
    estimate.world_from_camera.push_back(pose.world_from_camera);
  }
  estimate.states = {FrameState::keyframe, FrameState::resected, FrameState::lost,
                     FrameState::resected, FrameState::keyframe};
  estimate.lens = world.camera.lens;
  estimate.map.vertices = {Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1.5, 1.25)};
  estimate.map.triangles = {{0, 1, 2}};
  estimate.map.colors = {Vec3f(1, 0, 0), Vec3f(0, 1, 0), Vec3f(0, 0, 1)};
  estimate.map.sigma = {0.25f, 0.5f, 1.0f};
  estimate.points = {Vec3(0.1, 0.2, 0.3), Vec3(-1e-9, 1e9, 1.0 / 3.0)};
  estimate.stages = {{"keyframes", 1.25, 100.0}, {"bundle", 2.5, 120.5}};
  estimate.path_s = 3.75;
  estimate.numbers = {
      {"keyframes", 2.0}, {"mean_reprojection_px", 0.123456789012345678}, {"unknown", NAN}};
  estimate.options_json = R"({"method":"paper","seed":1})";
  return estimate;
}

TEST(Estimate, RoundTrip) {
  const TemporaryFolder folder("estimate");
  const Estimate a = example();
  write_estimate(folder.path() / "e", a);
  const Estimate b = read_estimate(folder.path() / "e");
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.times_s, b.times_s);
  EXPECT_EQ(a.states, b.states);
  for (std::size_t i = 0; i < a.times_s.size(); ++i) {
    if (a.states[i] == FrameState::lost) continue;
    EXPECT_EQ(a.world_from_camera[i].translation, b.world_from_camera[i].translation);
    constexpr double kLastBits = 1e-15;  // the quaternion is normalised again after reading
    EXPECT_TRUE(
        (a.world_from_camera[i].rotation.coeffs() - b.world_from_camera[i].rotation.coeffs())
            .norm() <= kLastBits);
  }
  EXPECT_EQ(a.lens.fx, b.lens.fx);
  EXPECT_EQ(a.lens.p1, b.lens.p1);
  EXPECT_EQ(a.map.vertices, b.map.vertices);  // the example's are floats
  EXPECT_EQ(a.map.triangles, b.map.triangles);
  EXPECT_EQ(a.map.sigma, b.map.sigma);
  EXPECT_EQ(a.map.colors, b.map.colors);
  EXPECT_EQ(a.points, b.points);
  ASSERT_EQ(b.stages.size(), 2u);
  EXPECT_EQ(b.stages[1].name, "bundle");
  EXPECT_EQ(b.stages[1].seconds, 2.5);
  EXPECT_EQ(b.stages[1].peak_rss_mb, 120.5);
  EXPECT_EQ(b.path_s, 3.75);
  EXPECT_EQ(b.numbers.at("mean_reprojection_px"), a.numbers.at("mean_reprojection_px"));
  EXPECT_TRUE(std::isnan(b.numbers.at("unknown")));
  EXPECT_EQ(b.options_json, a.options_json);
  EXPECT_FALSE(b.scale_sigma_share.has_value());
}

TEST(Estimate, InMillimetresItSaysSo) {
  const TemporaryFolder folder("estimate_mm");
  Estimate estimate = example();
  estimate.scale_sigma_share = 0.0123;
  write_estimate(folder.path() / "e", estimate);
  EXPECT_EQ(read_estimate(folder.path() / "e").scale_sigma_share, 0.0123);
  const std::string info = read_text(EstimateLayout{folder.path() / "e"}.info());
  EXPECT_NE(info.find("\"length\": \"mm\""), std::string::npos) << info;
}

TEST(Estimate, TheTrackHoldsTheTrackedFramesOnly) {
  const Estimate estimate = example();
  const PoseTrack track = estimate.track();
  ASSERT_EQ(track.size(), 4u);
  EXPECT_EQ(track[2].time_s, estimate.times_s[3]);
}

TEST(Estimate, WithoutAMapOrAnyPose) {
  const TemporaryFolder folder("estimate_empty");
  Estimate estimate = example();
  estimate.map = {};
  estimate.points.clear();
  estimate.states.assign(5, FrameState::lost);
  write_estimate(folder.path(), estimate);
  const Estimate back = read_estimate(folder.path());
  EXPECT_TRUE(back.map.empty());
  EXPECT_TRUE(back.points.empty());
  EXPECT_TRUE(back.track().empty());
}

TEST(Estimate, AnUnfinishedOneIsRefused) {
  const TemporaryFolder folder("estimate_unfinished");
  EXPECT_EQ(error_of([&] { read_estimate(folder.path() / "none"); }),
            (folder.path() / "none").string() + ": no such folder");
  write_estimate(folder.path(), example());
  fs::remove(folder.path() / "estimate.json");
  EXPECT_EQ(error_of([&] { read_estimate(folder.path()); }),
            folder.path().string() + ": the estimate was not finished (no estimate.json)");
}

TEST(Estimate, WhatAnEarlierOneLeftIsDiscarded) {
  const TemporaryFolder folder("estimate");
  const EstimateLayout layout{folder.path()};
  make_folder(layout.depth_folder());
  make_folder(layout.pictures() / "mosaic");
  write_atomic(layout.pictures() / "mosaic" / "000000.png", "");
  discard_estimate(folder.path());  // whose pictures these are nobody knows
  EXPECT_TRUE(fs::exists(layout.pictures() / "mosaic" / "000000.png"));
  write_estimate(folder.path(), example());
  write_atomic(layout.depth(4), "");
  write_atomic(folder.path() / "notes.txt", "");
  discard_estimate(folder.path());
  EXPECT_FALSE(fs::exists(layout.info()));
  EXPECT_FALSE(fs::exists(layout.depth(4)));
  EXPECT_FALSE(fs::exists(layout.map_ply()) || fs::exists(layout.map_glb()));
  EXPECT_FALSE(fs::exists(layout.pictures()));
  EXPECT_TRUE(fs::exists(folder.path() / "notes.txt"));

  write_estimate(folder.path(), example());
  Estimate without_map = example();
  without_map.map = {};
  write_estimate(folder.path(), without_map);
  EXPECT_FALSE(fs::exists(layout.map_glb()));
}

TEST(Estimate, ListAndTrajectoryMustAgree) {
  const TemporaryFolder folder("estimate_disagree");
  write_estimate(folder.path(), example());
  const EstimateLayout layout{folder.path()};
  std::string list = read_text(layout.frame_list());
  const auto lost = list.find("lost");
  list.replace(lost, 4, "resected");
  write_atomic(layout.frame_list(), list);
  EXPECT_EQ(error_of([&] { read_estimate(folder.path()); }),
            layout.trajectory().string() + ": no pose at 0.2 s, though " +
                layout.frame_list().string() + " calls frame 2 resected");
  list.replace(lost, 8, "floating");
  write_atomic(layout.frame_list(), list);
  EXPECT_EQ(error_of([&] { read_estimate(folder.path()); }),
            layout.frame_list().string() +
                ":4: state 'floating', expected one of: lost, keyframe, resected");
}

// Whatever a damaged byte does to a PLY, it is read or refused, and never read beyond its end.
TEST(Estimate, EveryDamagedByteOfAMapIsSurvived) {
  const TemporaryFolder folder("estimate_damage");
  const fs::path file = folder.path() / "map.ply";
  write_ply(file, example().map);
  const std::string whole = read_text(file);
  int refused = 0;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x09);  // turns digits into other digits
    write_atomic(file, bytes);
    const std::string error = error_of([&] { read_ply(file); });
    EXPECT_TRUE(error == "no error" || error.starts_with(file.string() + ": ")) << error;
    refused += error != "no error";
  }
  EXPECT_GT(refused, 150);  // nearly all of the header of about 300 bytes
}

TEST(Estimate, ATruncatedMapIsNamed) {
  const TemporaryFolder folder("estimate_map");
  write_estimate(folder.path(), example());
  const EstimateLayout layout{folder.path()};
  fs::resize_file(layout.map_ply(), fs::file_size(layout.map_ply()) - 5);
  EXPECT_EQ(error_of([&] { read_estimate(folder.path()); }),
            layout.map_ply().string() + ": truncated or damaged: 65 bytes of data, expected 70");
  write_atomic(layout.map_ply(), "solid cube");
  EXPECT_EQ(error_of([&] { read_estimate(folder.path()); }),
            layout.map_ply().string() + ": not a binary PLY of this program");
}

}  // namespace
}  // namespace rugae
