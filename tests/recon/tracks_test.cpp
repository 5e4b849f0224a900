// Chaining correspondences into tracks.

#include "recon/tracks.h"

#include <gtest/gtest.h>

#include "synthetic.h"

namespace rugae {
namespace {

constexpr double kSpacingPx = 14.0;

// Three points that move by (10, 0) a key frame, followed to the next two.
TEST(TrackChain, FollowsPointsOverManyKeyframes) {
  const std::vector<Vec2> fresh = {{100.25, 100.5}, {200.5, 100.5}, {300.5, 100.75}};
  TrackChain chain;
  for (int k = 0; k < 5; ++k) {
    const auto starts = chain.starts(k, k == 0 ? fresh : std::vector<Vec2>{}, kSpacingPx);
    ASSERT_EQ(starts.size(), 3u);
    for (int m = k + 1; m <= std::min(4, k + 2); ++m) {
      std::vector<Vec2> there;
      for (const Vec2& p : starts) there.emplace_back(p.x() + 10.0 * (m - k), p.y());
      chain.add(m, {0, 1, 2}, there, kSpacingPx);
    }
  }
  const auto tracks = chain.finish();
  ASSERT_EQ(tracks.size(), 3u);
  for (std::size_t t = 0; t < 3; ++t) {
    ASSERT_EQ(tracks[t].observations.size(), 5u);
    for (int k = 0; k < 5; ++k) {
      EXPECT_EQ(tracks[t].observations[k].keyframe, k);
      EXPECT_EQ(tracks[t].observations[k].pixel, Vec2(fresh[t].x() + 10.0 * k, fresh[t].y()));
    }
  }
}

TEST(TrackChain, KeepsThePositionFollowedFromFurthestBack) {
  TrackChain chain;
  chain.starts(0, {{100.5, 100.5}}, kSpacingPx);
  chain.add(1, {0}, {{110.5, 100.5}}, kSpacingPx);
  chain.add(2, {0}, {{120.5, 100.5}}, kSpacingPx);
  chain.starts(1, {}, kSpacingPx);
  chain.add(2, {0}, {{127.5, 100.5}},
            kSpacingPx);  // known from key frame 0 already, far enough to be another
  chain.add(3, {0}, {{130.5, 100.5}}, kSpacingPx);
  const auto tracks = chain.finish();
  ASSERT_EQ(tracks.size(), 1u);
  ASSERT_EQ(tracks[0].observations.size(), 4u);
  EXPECT_EQ(tracks[0].observations[2].pixel, Vec2(120.5, 100.5));
}

TEST(TrackChain, FreshPointsKeepTheirDistance) {
  TrackChain chain;
  chain.starts(0, {{100.5, 100.5}, {105.5, 100.5}, {120.5, 100.5}}, kSpacingPx);
  chain.add(1, {0, 1}, {{100.5, 100.5}, {120.5, 100.5}}, kSpacingPx);
  // The second of the three was too near the first, and so is one of the new ones.
  const auto starts = chain.starts(1, {{101.5, 101.5}, {300.5, 100.5}}, kSpacingPx);
  EXPECT_EQ(starts.size(), 3u);
}

TEST(TrackChain, TracksThatRunTogetherAreOne) {
  TrackChain chain;
  chain.starts(0, {{100.5, 100.5}, {120.5, 100.5}}, kSpacingPx);
  chain.add(1, {0, 1}, {{110.5, 100.5}, {111.0, 100.5}}, kSpacingPx);
  EXPECT_EQ(chain.starts(1, {}, kSpacingPx).size(), 1u);
  EXPECT_EQ(chain.finish().size(), 1u);  // the other was seen once only
}

TEST(Tracks, RaysAreThoseOfTheLens) {
  const Lens lens = synthetic::lens_of(640, 480);
  std::vector<Track> tracks(1);
  tracks[0].observations = {{0, Vec2(320.0, 240.0)}, {1, Vec2(320.0 + lens.fx, 240.0)}};
  set_rays(tracks, lens);
  EXPECT_TRUE(tracks[0].observations[0].ray.norm() <= 1e-12);
  EXPECT_TRUE((tracks[0].observations[1].ray - Vec2(1.0, 0.0)).norm() <= 1e-12);
}

TEST(Tracks, SeedsOfPairsDiffer) {
  EXPECT_NE(pair_seed(1, 3, 4), pair_seed(1, 4, 3));
  EXPECT_NE(pair_seed(1, 3, 4), pair_seed(2, 3, 4));
  EXPECT_EQ(pair_seed(1, 3, 4), pair_seed(1, 3, 4));
}

}  // namespace
}  // namespace rugae
