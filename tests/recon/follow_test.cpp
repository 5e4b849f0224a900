// Following points between key frames, and the key frames that have to come between.

#include <gtest/gtest.h>

#include <algorithm>

#include "image_sequence.h"
#include "recon/tracks.h"

namespace rugae {
namespace {

using FollowTracks = testing::ImageSequence;

// A shift is followed to less than this over four key frames; a wrong match is off by whole pixels.
constexpr double kTrackPx = 0.25;

Followed follow(const FrameSource& frames, const std::vector<int>& keyframes) {
  TrackFollower follower(frames, {}, {}, 1);
  for (const int frame : keyframes) follower.add(frame);
  return follower.finish();
}

std::ptrdiff_t shared(const std::vector<Track>& tracks, int first, int second) {
  return std::ranges::count_if(tracks, [&](const Track& track) {
    const auto seen_by = [&](int keyframe) {
      return std::ranges::find(track.observations, keyframe, &Track::Observation::keyframe) !=
             track.observations.end();
    };
    return seen_by(first) && seen_by(second);
  });
}

// Every observation stands where the wall's shift since the first one has put it.
void expect_exact(const std::vector<Track>& tracks, const std::vector<double>& shift_px) {
  for (const Track& track : tracks) {
    const auto& first = track.observations.front();
    for (const auto& o : track.observations) {
      const Vec2 wall(shift_px[o.keyframe] - shift_px[first.keyframe], 0.0);
      EXPECT_LE((o.pixel + wall - first.pixel).norm(), kTrackPx);
    }
  }
}

TEST_F(FollowTracks, KeyFramesNearEnoughStayAsTheyWere) {
  const Followed followed = follow(source({8, 8, 8, 8}, plain()), {0, 2, 4});
  EXPECT_EQ(followed.keyframes, (std::vector<int>{0, 2, 4}));
  EXPECT_GT(followed.tracks.size(), 100u);
  expect_exact(followed.tracks, {0, 16, 32});
}

// 160 px of 320 are too far for the flow; the key frame between is found by halving.
TEST_F(FollowTracks, AKeyFrameThatComesTooLateGetsOthersBeforeIt) {
  const Followed followed = follow(source({10, 10, 40, 40, 40, 40, 10}, plain()), {0, 2, 6, 7});
  EXPECT_EQ(followed.keyframes, (std::vector<int>{0, 2, 4, 6, 7}));
  expect_exact(followed.tracks, {0, 20, 100, 180, 190});
  // The tracks go across: each key frame shares some with the next.
  for (int k = 0; k < 4; ++k) EXPECT_GE(shared(followed.tracks, k, k + 1), 30) << k;
}

// The far wall can be followed over four frames, the near one, three fifths of the picture, cannot.
TEST_F(FollowTracks, AKeyFrameThatLosesTheNearWallGetsOthersBeforeIt) {
  constexpr int kNearRow = 96, kTimes = 6;
  const Followed followed =
      follow(source({6, 6, 6, 6}, plain(), ~std::size_t{0}, {kNearRow, kTimes}), {0, 4});
  ASSERT_GT(followed.keyframes.size(), 2u);
  std::vector<Track> near;
  for (const Track& track : followed.tracks)
    if (track.observations.front().pixel.y() > kNearRow + 20) near.push_back(track);
  for (int k = 0; k + 1 < static_cast<int>(followed.keyframes.size()); ++k)
    EXPECT_GE(shared(near, k, k + 1), 30) << followed.keyframes[k];
}

TEST_F(FollowTracks, WhereTheWallIsAnotherTheChainBreaksAndNoKeyFrameComesBetween) {
  const Followed followed = follow(source({8, 8, 8, 8, 8}, plain(), 3), {0, 2, 4, 5});
  EXPECT_EQ(followed.keyframes, (std::vector<int>{0, 2, 4, 5}));
  EXPECT_EQ(followed.pairs.size(), 2u);
  for (const Track& track : followed.tracks)
    EXPECT_FALSE(track.observations.front().keyframe < 2 &&
                 track.observations.back().keyframe >= 2);
}

}  // namespace
}  // namespace rugae
