#include "recon/live_path.h"

#include <algorithm>

namespace rugae {

LivePath::LivePath(const FrameSource& frames, const ReconOptions& options)
    : frames_(frames),
      growth_(structure_, frames.lens().fx, options.bundle),
      resector_(frames, options.align, options.bundle, options.seed) {}

// What was followed into the key frame, or began in it, since it was asked last.
void LivePath::take(const TrackChain& chain, int keyframe) {
  Structure& s = structure_;
  const int frame = s.frames[static_cast<std::size_t>(keyframe)];
  const std::vector<int>& through = chain.through(frame);
  const LensProjector projector(frames_.lens());
  std::size_t& taken = taken_[static_cast<std::size_t>(keyframe)];
  for (; taken < through.size(); ++taken) {
    const auto t = static_cast<std::size_t>(through[taken]);
    if (s.tracks.size() <= t) s.tracks.resize(t + 1);
    const auto& followed = chain.tracks()[t].observations;
    const auto at = std::ranges::find(followed, frame, &Track::Observation::keyframe);
    const auto ray = ray_of(projector, at->pixel);
    if (!ray) continue;
    auto& observations = s.tracks[t].observations;
    observations.push_back({keyframe, at->pixel, *ray});
    std::ranges::sort(observations, {}, &Track::Observation::keyframe);
  }
}

void LivePath::update(const TrackFollower& follower) {
  Structure& s = structure_;
  const std::vector<int> settled = follower.settled();
  for (std::size_t k = s.frames.size(); k < settled.size(); ++k) {
    s.frames.push_back(settled[k]);
    s.placed.push_back(false);
    s.cam_from_world.emplace_back();
    taken_.push_back(0);
  }
  for (std::size_t k = 0; k < s.frames.size(); ++k) take(follower.chain(), static_cast<int>(k));
  Progress quiet(Progress::Output::silent);
  const std::vector<char> available(s.frames.size(), 1);
  if (!begun_) begun_ = growth_.begin(available);
  if (begun_) growth_.extend(available, quiet);
}

std::optional<Rigid3> LivePath::place(int frame) const {
  const auto key = std::ranges::find(structure_.frames, frame);
  if (key != structure_.frames.end()) {
    const auto k = static_cast<std::size_t>(key - structure_.frames.begin());
    if (structure_.placed[k]) return structure_.cam_from_world[k];
  }
  return resector_.place(structure_, frame);
}

}  // namespace rugae
