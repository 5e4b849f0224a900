#include "recon/motion.h"

#include <algorithm>

#include "core/check.h"
#include "core/spread.h"

namespace rugae {
namespace {

constexpr int kPairsForPictures = 6;

// Some of the pairs that have correspondences keep them.
void keep_for_pictures(std::vector<PairAlignment>& pairs) {
  std::vector<std::size_t> with;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (!pairs[i].reference_px.empty()) with.push_back(i);
  std::vector<char> kept(pairs.size(), 0);
  for (const int i : spread(static_cast<int>(with.size()), kPairsForPictures)) kept[with[i]] = 1;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (!kept[i]) pairs[i].forget_correspondences();
}

}  // namespace

Motion solve_motion(const FrameSource& frames, Followed followed, const ReconOptions& options,
                    const Stages& stages, Progress& progress) {
  Motion motion;
  motion.structure =
      stages.structure(frames, followed.keyframes, std::move(followed.tracks), options, progress);
  motion.cam_from_world = stages.resect(frames, motion.structure, options, progress);
  progress.end();
  motion.pairs = std::move(followed.pairs);
  keep_for_pictures(motion.pairs);
  const auto usable =
      std::ranges::count_if(motion.cam_from_world, [](const auto& p) { return p.has_value(); });
  check(
      usable >= 2,
      "{}: {} usable frames of {}, expected at least 2: the others show too little texture, light "
      "or common wall to be placed",
      frames.observations().name(), usable, frames.size());
  return motion;
}

Motion estimate_motion(const FrameSource& frames, const ReconOptions& options, const Stages& stages,
                       Progress& progress) {
  const std::size_t earlier = progress.stages().size();  // of the caller
  // Algorithm 2, key frames, and of algorithm 3 steps 2 to 6, pairs.
  Followed followed = stages.follow(frames, options, progress);
  const std::vector<StageTime> following = followed.stages;
  const std::size_t before = progress.stages().size();
  // Algorithm 3, step 7, all poses jointly.
  Motion motion = solve_motion(frames, std::move(followed), options, stages, progress);
  const auto at = [&](std::size_t i) {
    return progress.stages().begin() + static_cast<std::ptrdiff_t>(i);
  };
  motion.stages.assign(at(earlier), at(before));
  // The one stage that following was on the terminal is known in its parts.
  if (!following.empty()) motion.stages.pop_back();
  motion.stages.insert(motion.stages.end(), following.begin(), following.end());
  motion.stages.insert(motion.stages.end(), at(before), progress.stages().end());
  return motion;
}

ReconOptions motion_options(ReconOptions options) {
  const ReconOptions defaults;
  ReflectionOptions& reflections = options.preprocess.reflections;
  reflections.suppress_for_map = defaults.preprocess.reflections.suppress_for_map;
  if (!reflections.suppress_for_pose) {
    reflections.inpainting = defaults.preprocess.reflections.inpainting;
    reflections.inpaint_radius_px = defaults.preprocess.reflections.inpaint_radius_px;
  }
  options.mosaic = defaults.mosaic;
  options.shading = defaults.shading;
  options.map = defaults.map;
  options.dense = defaults.dense;
  if (options.method != "dense") options.revisits = defaults.revisits;
  options.pictures = defaults.pictures;
  return options;
}

}  // namespace rugae
