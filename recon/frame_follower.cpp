#include "recon/frame_follower.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>

#include "core/seconds_of.h"

namespace rugae {

AlignOptions follow_options(const ReconOptions& options) {
  AlignOptions align = options.align;
  if (options.method == "dense") {
    align.neighbours = options.revisits.neighbours;
    align.affine = false;  // it goes by the points
  }
  return align;
}

FrameFollower::FrameFollower(const FrameSource& frames, const ReconOptions& options, bool ahead)
    : selector_(frames, options.keyframes),
      follower_(frames, follow_options(options), options.tracks, options.seed, ahead) {}

void FrameFollower::look_at(int end) {
  // A copy, for the list grows meanwhile.
  const std::vector<int>& chosen = selector_.keyframes().frames;
  const std::vector<int> before(chosen.begin() + static_cast<std::ptrdiff_t>(followed_),
                                chosen.end());
  double selecting_s = 0.0, following_s = 0.0;
  const double passed_s = seconds_of([&] {
    tbb::parallel_invoke([&] { selecting_s = seconds_of([&] { selector_.advance(end); }); },
                         [&] {
                           following_s = seconds_of([&] {
                             for (const int frame : before) follower_.add(frame);
                           });
                         });
  });
  const double share = passed_s / std::max(selecting_s + following_s, 1e-9);
  selecting_.seconds += share * selecting_s;
  following_.seconds += share * following_s;
  selecting_.peak_rss_mb = following_.peak_rss_mb = peak_rss_mb();
  followed_ += before.size();
  looked_at_ = std::max(looked_at_, end);
}

void FrameFollower::catch_up() {
  following_.seconds += seconds_of([&] {
    const std::vector<int>& chosen = selector_.keyframes().frames;
    for (; followed_ < chosen.size(); ++followed_) follower_.add(chosen[followed_]);
  });
  following_.peak_rss_mb = peak_rss_mb();
}

Followed FrameFollower::finish() {
  catch_up();
  Followed followed;
  following_.seconds += seconds_of([&] { followed = follower_.finish(); });
  following_.peak_rss_mb = peak_rss_mb();
  followed.stages = stages();
  return followed;
}

Followed follow_frames(const FrameSource& frames, const ReconOptions& options, Progress& progress) {
  progress.begin("frames", static_cast<std::size_t>(frames.size()));
  FrameFollower follower(frames, options, true);
  while (follower.looked_at() < frames.size()) {
    const int begin = follower.looked_at(), end = std::min(begin + kFramesAtOnce, frames.size());
    follower.look_at(end);
    progress.step(static_cast<std::size_t>(end - begin));
  }
  Followed followed = follower.finish();
  progress.end(fmt::format("{} key frames, {} pairs, {} tracks, {}", followed.keyframes.size(),
                           followed.pairs.size(), followed.tracks.size(),
                           follower.tracks().remark()));
  return followed;
}

}  // namespace rugae
