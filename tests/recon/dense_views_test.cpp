// Which key frames get a depth map and what they are compared with; the grid they share.

#include <gtest/gtest.h>

#include <algorithm>

#include "core/check.h"
#include "core/units.h"
#include "recon/dense/pinhole_grid.h"
#include "recon/dense/view_choice.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

constexpr double kDistance = 30.0;

/// Key frames at these places, which all see 60 points around (0, 0, 30).
Structure row_of(const std::vector<Vec3>& centres) {
  Structure structure;
  for (std::size_t k = 0; k < centres.size(); ++k) {
    structure.frames.push_back(static_cast<int>(k));
    structure.placed.push_back(true);
    structure.cam_from_world.push_back(Rigid3(Quat::Identity(), -centres[k]));
  }
  for (int i = 0; i < 60; ++i) {
    Track track;
    track.point = {0.1 * (i % 8) - 0.4, 0.1 * (i / 8) - 0.4, kDistance};
    track.triangulated = true;
    for (std::size_t k = 0; k < centres.size(); ++k)
      track.observations.push_back({static_cast<int>(k), {0.0, 0.0}});
    structure.tracks.push_back(track);
  }
  return structure;
}

Vec3 at_angle(double degrees) {
  const double angle = degrees * kPi / 180.0;
  return {kDistance * std::sin(angle), 0.0, kDistance * (1.0 - std::cos(angle))};
}

TEST(DenseViews, TriangulationIsBestAtFiveDegrees) {
  constexpr double kDegree = kPi / 180.0;
  EXPECT_DOUBLE_EQ(triangulation_weight(5.0 * kDegree), 1.0);
  EXPECT_LT(triangulation_weight(0.5 * kDegree), 0.1);
  EXPECT_GT(triangulation_weight(3.0 * kDegree), 0.5);
  EXPECT_GT(triangulation_weight(12.0 * kDegree), 0.6);
  EXPECT_LT(triangulation_weight(30.0 * kDegree), 0.01);
}

TEST(DenseViews, SourcesSeeThePointsFromGoodAnglesAndAlikeDistances) {
  Vec3 far_off = at_angle(5.0);
  far_off.z() -= 2.0 * kDistance;
  const Structure structure = row_of({at_angle(0.0), at_angle(0.2), at_angle(5.0), at_angle(-7.0),
                                      at_angle(60.0), at_angle(9.0), far_off});
  DenseOptions options;
  options.views = 3;
  options.max_depth_maps = 10;
  for (const StereoSet& set : choose_views(structure, options)) {
    ASSERT_LE(set.sources.size(), 3u);
    if (set.reference != 0) continue;
    std::vector<int> sources = set.sources;
    std::ranges::sort(sources);
    EXPECT_EQ(sources, (std::vector<int>{2, 3, 5}));
    return;
  }
  FAIL() << "key frame 0 has no depth map";
}

TEST(DenseViews, EveryPointIsInAsManyDepthMapsAsWantedAndNoMore) {
  std::vector<Vec3> centres;
  for (int i = 0; i < 12; ++i) centres.push_back(at_angle(2.0 * i - 11.0));
  Structure structure = row_of(centres);
  DenseOptions options;
  options.depth_maps_a_point = 4;
  EXPECT_EQ(choose_views(structure, options).size(), 4u);
  options.max_depth_maps = 3;
  EXPECT_EQ(choose_views(structure, options).size(), 3u);
  structure.placed.assign(12, false);
  EXPECT_TRUE(choose_views(structure, options).empty());
}

TEST(DenseViews, KeyFramesThatAreNotPlacedAreNeverUsed) {
  std::vector<Vec3> centres;
  for (int i = 0; i < 8; ++i) centres.push_back(at_angle(2.0 * i - 7.0));
  Structure structure = row_of(centres);
  structure.placed[3] = false;
  DenseOptions options;
  options.depth_maps_a_point = 8;
  const auto sets = choose_views(structure, options);
  EXPECT_EQ(sets.size(), 7u);
  for (const StereoSet& set : sets) {
    EXPECT_NE(set.reference, 3);
    EXPECT_EQ(std::ranges::count(set.sources, 3), 0);
    EXPECT_EQ(std::ranges::count(set.sources, set.reference), 0);
  }
}

TEST(DenseViews, OptionsNameTheBadField) {
  DenseOptions options;
  options.check();
  options.views = 1;
  EXPECT_NE(message_of([&] { options.check(); }).find("views is 1"), std::string::npos);
}

// --- The grid --------------------------------------------------------------------------------

Lens barrel_lens() {
  Lens lens;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 346.0;
  lens.cx = 322.0;
  lens.cy = 237.0;
  lens.k1 = -0.2;
  lens.k2 = 0.03;
  return lens;
}

TEST(DenseGrid, SeesAllThatTheLensSees) {
  const Lens lens = barrel_lens();
  const PinholeGrid grid = wide_grid(lens, 400);
  EXPECT_EQ(grid.width, 400);
  for (int x = 0; x <= 640; x += 40)
    for (int y = 0; y <= 480; y += 40) {
      const auto ray = lens.unproject(Vec2(x, y));
      ASSERT_TRUE(ray);
      const Vec2 pixel = grid.project(*ray);
      EXPECT_TRUE(pixel.x() >= -1e-6 && pixel.y() >= -1.0 && pixel.x() <= grid.width + 1e-6 &&
                  pixel.y() <= grid.height + 1.0)
          << x << " " << y << ": " << pixel.transpose();
    }
}

TEST(DenseGrid, IsNowhereFinerThanTheLens) {
  Lens lens = barrel_lens();
  lens.k1 = lens.k2 = 0.0;
  const PinholeGrid grid = wide_grid(lens, 4000);
  EXPECT_EQ(grid.width, 640);
  EXPECT_EQ(grid.height, 480);
  EXPECT_NEAR(grid.cx, lens.cx, 1e-9);
  EXPECT_NEAR(grid.cy, lens.cy, 1e-9);
}

TEST(DenseGrid, HalvedSeesTheSame) {
  const PinholeGrid grid{161, 120, 80.0, 82.0, 79.0, 61.0}, half = halved(grid);
  EXPECT_EQ(half.width, 81);
  EXPECT_EQ(half.height, 60);
  const Vec3 p(3.0, -4.0, 20.0);
  EXPECT_LE((grid.project(p) - 2.0 * half.project(p)).norm(), 1e-12);
  EXPECT_LE((grid.project(grid.ray(7, 9)) - Vec2(7.5, 9.5)).norm(), 1e-12);
}

}  // namespace
}  // namespace rugae
