// Following points between key frames, and the key frames that have to come between.

#include <gtest/gtest.h>

#include <algorithm>

#include "core/seconds_of.h"
#include "image_sequence.h"
#include "recon/frame_follower.h"

namespace rugae {
namespace {

using FollowTracks = testing::ImageSequence;

// A shift is followed to less than this over four key frames; a wrong match is off by whole pixels.
constexpr double kTrackPx = 0.25;
// Of the time that passes, what is told of; the rest is the loop around it.
constexpr double kAccountedShare = 0.8;

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

// Looked at one by one, in lots, or all at once; and the parts' times add up to what passed.
TEST_F(FollowTracks, HoweverManyFramesComeAtATime) {
  const FrameSource frames =
      source({3, 9, 12, 14, 2, 7, 7, 1, 12, 3, 15, 14, 13, 4, 4, 4, 4, 4, 6, 9}, plain());
  std::vector<Followed> found;
  for (const int lot : {1, 3, kFramesAtOnce, frames.size()}) {
    FrameFollower follower(frames, {}, lot > 1);
    const double passed_s = seconds_of([&] {
      while (follower.looked_at() < frames.size()) {
        follower.look_at(std::min(follower.looked_at() + lot, frames.size()));
        if (lot == 1) follower.catch_up();
      }
      found.push_back(follower.finish());
    });
    double parts_s = 0.0;
    for (const StageTime& stage : found.back().stages) {
      EXPECT_TRUE(stage.seconds > 0.0) << stage.name;
      parts_s += stage.seconds;
    }
    EXPECT_TRUE(parts_s <= passed_s && parts_s >= kAccountedShare * passed_s)
        << parts_s << " of " << passed_s;
  }
  ASSERT_GT(found[0].keyframes.size(), 4u);
  ASSERT_GT(found[0].tracks.size(), 100u);
  for (const Followed& other : found) {
    EXPECT_EQ(other.keyframes, found[0].keyframes);
    ASSERT_EQ(other.tracks.size(), found[0].tracks.size());
    for (std::size_t t = 0; t < other.tracks.size(); ++t) {
      const auto &a = other.tracks[t].observations, &b = found[0].tracks[t].observations;
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i)
        EXPECT_TRUE(a[i].keyframe == b[i].keyframe && a[i].pixel == b[i].pixel);
    }
  }
}

}  // namespace
}  // namespace rugae
