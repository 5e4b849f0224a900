// The ladder's first rungs: exact tracks give back poses and points to machine precision, noisy
// ones to what their noise allows.

#include "recon/structure.h"

#include <gtest/gtest.h>

#include "core/sim3.h"
#include "recon/triangulation.h"
#include "recon/two_view.h"
#include "synthetic.h"

namespace rugae {
namespace {

using synthetic::make_world;
using synthetic::Options;
using synthetic::path_error;
using synthetic::World;

Structure build(const World& world) {
  Progress progress(Progress::Output::silent);
  return build_structure(world.frames, world.tracks, world.lens, BundleOptions{}, kFinalAdjustment,
                         progress);
}

// What the problem demands of exact tracks: 1e-6 of the path's extent.
constexpr double kExact = 1e-6;

TEST(Structure, ExactTracksGiveBackThePoses) {
  const World world = make_world({});
  const Structure s = build(world);
  const auto error = path_error(s, world);
  EXPECT_EQ(error.cameras, 12);
  EXPECT_TRUE(error.rmse <= kExact * error.path_extent) << error.rmse;
  EXPECT_TRUE(error.worst_rotation_rad <= kExact) << error.worst_rotation_rad;
  EXPECT_TRUE(s.mean_reprojection_px <= 1e-6) << s.mean_reprojection_px;
  EXPECT_TRUE(s.converged);
}

TEST(Structure, ExactTracksGiveBackThePoints) {
  const World world = make_world({});
  const Structure s = build(world);
  ASSERT_GT(s.tracks.size(), world.tracks.size() / 2);
  std::vector<Vec3> source, target;
  for (const Track& track : s.tracks) {
    // A track is known again by its first pixel.
    for (std::size_t i = 0; i < world.tracks.size(); ++i) {
      const auto& o = world.tracks[i].observations.front();
      if (o.keyframe != track.observations.front().keyframe ||
          o.pixel != track.observations.front().pixel)
        continue;
      source.push_back(track.point);
      target.push_back(world.points[i]);
    }
  }
  ASSERT_EQ(source.size(), s.tracks.size());
  const auto truth_from_map = umeyama(source, target, true);
  ASSERT_TRUE(truth_from_map.has_value());
  double worst = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i)
    worst = std::max(worst, (*truth_from_map * source[i] - target[i]).norm());
  EXPECT_TRUE(worst <= 1e-5 * 40.0) << worst;  // points with little parallax amplify rounding
}

TEST(Structure, WorldIsTheFirstCameraAndItsMedianDepthIsOne) {
  const Structure s = build(make_world({.noise_px = 0.2}));
  ASSERT_TRUE(s.placed[0]);
  EXPECT_EQ(s.cam_from_world[0].translation, Vec3(Vec3::Zero()));
  std::vector<double> depths;
  for (const Track& track : s.tracks)
    for (const auto& o : track.observations)
      if (o.keyframe == 0) depths.push_back(track.point.z());
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  EXPECT_NEAR(depths[depths.size() / 2], 1.0, 1e-9);
}

// 0.2 px at f = 268 px is 0.75 mrad. A camera that sees a few hundred points at 30 mm stands to
// 30 mm 0.75e-3 / sqrt(200) = 1.6 um against them; over twelve cameras in a chain the errors of the
// points themselves (0.75 mrad 30 mm / 5 mm of base a step) and of the gauge dominate: some tens of
// um. 0.1 mm leaves room for the draw of the noise and is 500 times less than the path's extent.
constexpr double kNoisyRmseMm = 0.1;

TEST(Structure, NoisyTracksGiveWhatTheirNoiseAllows) {
  const World world = make_world({.noise_px = 0.2});
  const Structure s = build(world);
  const auto error = path_error(s, world);
  EXPECT_EQ(error.cameras, 12);
  EXPECT_TRUE(error.rmse <= kNoisyRmseMm) << error.rmse;
  // The mean length of a normal vector of standard deviation 0.2 in two dimensions is
  // 0.2 sqrt(pi / 2) = 0.25; the fit takes some of it.
  EXPECT_TRUE(s.mean_reprojection_px >= 0.15 && s.mean_reprojection_px <= 0.26)
      << s.mean_reprojection_px;
}

TEST(Structure, OutliersAreFoundAndDoNotMatter) {
  const World world = make_world({.noise_px = 0.2, .outlier_share = 0.1});
  const Structure s = build(world);
  const auto error = path_error(s, world);
  EXPECT_EQ(error.cameras, 12);
  EXPECT_TRUE(error.rmse <= 2.0 * kNoisyRmseMm) << error.rmse;
  EXPECT_TRUE(s.mean_reprojection_px <= 0.35) << s.mean_reprojection_px;
}

TEST(Structure, LongPathKeepsTogether) {
  const World world = make_world({.cameras = 60, .noise_px = 0.2});
  const Structure s = build(world);
  const auto error = path_error(s, world);
  EXPECT_EQ(error.cameras, 60);
  EXPECT_TRUE(error.rmse <= 0.01 * error.path_extent) << error.rmse;
}

// No key frame sees what the start saw but its next neighbours: each goes by the points of the one
// before.
TEST(Structure, ShortTracksMakeOnePathToo) {
  const World world = make_world({.cameras = 40, .points = 20000, .max_run = 4});
  const Structure s = build(world);
  const auto error = path_error(s, world);
  EXPECT_EQ(error.cameras, 40);
  EXPECT_TRUE(error.rmse <= kExact * error.path_extent) << error.rmse;
}

TEST(Structure, LengthsAndPlaceOfTheWorldDoNotMatter) {
  const Structure a = build(make_world({.noise_px = 0.2}));
  const Rigid3 moved(Quat(Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized())),
                     Vec3(5e4, -3e4, 7e4));
  const Structure b = build(make_world({.noise_px = 0.2, .unit = 1000.0, .moved = moved}));
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t k = 0; k < a.frames.size(); ++k)
    EXPECT_TRUE((a.cam_from_world[k].translation - b.cam_from_world[k].translation).norm() <= 1e-5);
}

TEST(Structure, ReversedSequenceGivesTheSamePath) {
  const World world = make_world({.noise_px = 0.2});
  World reversed = world;
  const int n = static_cast<int>(world.frames.size());
  std::reverse(reversed.cam_from_world.begin(), reversed.cam_from_world.end());
  for (Track& track : reversed.tracks) {
    std::reverse(track.observations.begin(), track.observations.end());
    for (auto& o : track.observations) o.keyframe = n - 1 - o.keyframe;
  }
  const Structure forward = build(world), backward = build(reversed);
  std::vector<Rigid3> a, b;
  for (int k = 0; k < n; ++k) {
    ASSERT_TRUE(forward.placed[k] && backward.placed[n - 1 - k]);
    a.push_back(forward.cam_from_world[k].inverse());
    b.push_back(backward.cam_from_world[n - 1 - k].inverse());
  }
  // Both minimise the same cost; another start may keep a few other observations.
  const auto difference = path_error(a, b);
  EXPECT_TRUE(difference.rmse <= 1e-3 * difference.path_extent) << difference.rmse;
}

// Two stretches of path without a common track cannot be joined: the larger one is placed.
TEST(Structure, WhatCannotBeJoinedIsNotPlaced) {
  World world = make_world({.cameras = 16});
  std::vector<Track> halves;
  for (const Track& track : world.tracks) {
    Track early, late;
    for (const auto& o : track.observations)
      (o.keyframe < 6 ? early : late).observations.push_back(o);
    for (Track& half : {std::ref(early), std::ref(late)})
      if (half.observations.size() >= 2) halves.push_back(half);
  }
  world.tracks = halves;
  const Structure s = build(world);
  EXPECT_EQ(s.placed_count(), 10);
  for (int k = 0; k < 16; ++k) EXPECT_EQ(s.placed[k], k >= 6) << k;
  EXPECT_TRUE(path_error(s, world).rmse <= kExact * 50.0);
}

// What the first segment's growth found to be wrong stays so while others are tried.
TEST(Structure, EachSegmentKeepsItsOutliers) {
  World world = make_world({.cameras = 16, .outlier_share = 0.1});
  const auto segments = [&world] {
    Progress progress(Progress::Output::silent);
    return build_segments(world.frames, world.tracks, world.lens, BundleOptions{}, progress);
  };
  const auto outliers_of = [](const Structure& s) {
    std::size_t outliers = 0;
    for (const Track& track : s.tracks)
      if (track.triangulated)
        for (const auto& o : track.observations) outliers += !o.inlier;
    return outliers;
  };
  const std::size_t in_one = outliers_of(segments().front());
  ASSERT_GT(in_one, 100u);
  // The last four key frames see nothing in common with the others, nor enough to be a segment.
  for (Track& track : world.tracks)
    std::erase_if(track.observations, [](const auto& o) { return o.keyframe >= 12; });
  const std::vector<Structure> cut = segments();
  EXPECT_EQ(cut.front().placed_count(), 12);
  EXPECT_GT(outliers_of(cut.front()), in_one / 2);
}

TEST(Structure, HopelessInputPlacesNothing) {
  World world = make_world({.cameras = 4});
  world.tracks.resize(5);
  EXPECT_EQ(build(world).placed_count(), 0);
  world.tracks.clear();
  EXPECT_EQ(build(world).placed_count(), 0);
}

TEST(TwoView, FlatWallIsNoTrap) {
  // Points on one plane: the essential matrix alone has two answers.
  const Rigid3 second_from_first(Quat(Eigen::AngleAxisd(0.15, Vec3(0.2, 1.0, 0.1).normalized())),
                                 Vec3(-0.3, 0.05, 0.1).normalized());
  std::vector<Vec2> first, second;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      const Vec3 p(0.3 * (i - 9.5), 0.25 * (j - 9.5), 5.0 + 0.1 * (i - 9.5));
      const Vec3 q = second_from_first * p;
      first.emplace_back(p.head<2>() / p.z());
      second.emplace_back(q.head<2>() / q.z());
    }
  }
  const auto view = two_view(first, second, 268.0, 1.0);
  ASSERT_TRUE(view.has_value());
  EXPECT_EQ(view->inliers, 400);
  EXPECT_TRUE(angle_between_rad(view->second_from_first.rotation, second_from_first.rotation) <=
              1e-6);
  EXPECT_TRUE((view->second_from_first.translation - second_from_first.translation).norm() <= 1e-5);
}

TEST(TwoView, TooFewCorrespondencesAreNoView) {
  EXPECT_FALSE(two_view({{0, 0}, {1, 1}}, {{0, 0}, {1, 1}}, 268.0, 1.0).has_value());
}

TEST(Triangulation, ExactSightsMeetInThePoint) {
  const Vec3 point(0.3, -0.2, 4.0);
  std::vector<Sight> sights;
  for (int i = 0; i < 5; ++i) {
    Sight s;
    s.cam_from_world =
        Rigid3(Quat(Eigen::AngleAxisd(0.05 * i, Vec3::UnitY())), Vec3(-0.2 * i, 0.01 * i, 0.0));
    const Vec3 p = s.cam_from_world * point;
    s.ray = p.head<2>() / p.z();
    sights.push_back(s);
  }
  const auto found = triangulate(sights);
  ASSERT_TRUE(found.has_value());
  EXPECT_TRUE((*found - point).norm() <= 1e-12);
  // One wrong sight is found out.
  sights[2].ray.x() += 0.05;
  const auto robust = triangulate_robust(sights, 0.003, 0.01);
  ASSERT_TRUE(robust.has_value());
  EXPECT_EQ(robust->inliers, 4);
  EXPECT_FALSE(robust->inlier[2]);
  EXPECT_TRUE((robust->point - point).norm() <= 1e-12);
  // Too little parallax is no point.
  EXPECT_FALSE(triangulate_robust({sights[0], sights[1]}, 0.003, 0.5).has_value());
}

// Two sights always agree on a point: two against two decide nothing.
TEST(Triangulation, HalfOfTheSightsAreNotEnough) {
  const Vec3 here(0.2, 0.1, 5.0), there(-0.9, 0.8, 4.0);
  std::vector<Sight> sights;
  for (int i = 0; i < 4; ++i) {
    Sight sight;
    sight.cam_from_world = Rigid3(Quat::Identity(), Vec3(-0.5 * i, 0.2 * (i % 3), 0.0));
    const Vec3 p = sight.cam_from_world * (i < 2 ? here : there);
    sight.ray = p.head<2>() / p.z();
    sights.push_back(sight);
  }
  EXPECT_FALSE(triangulate_robust(sights, 0.003, 0.01).has_value());
  sights.resize(3);
  EXPECT_TRUE(triangulate_robust(sights, 0.003, 0.01).has_value());
}

}  // namespace
}  // namespace rugae
