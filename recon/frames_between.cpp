#include "recon/frames_between.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace rugae {

std::vector<int> placed_keyframes(const Structure& structure) {
  std::vector<int> placed;
  for (std::size_t k = 0; k < structure.frames.size(); ++k)
    if (structure.placed[k]) placed.push_back(static_cast<int>(k));
  return placed;
}

std::vector<std::optional<Rigid3>> keyframe_poses(const Structure& structure, int frames) {
  std::vector<std::optional<Rigid3>> poses(static_cast<std::size_t>(frames));
  for (const int k : placed_keyframes(structure))
    poses[structure.frames[k]] = structure.cam_from_world[k];
  return poses;
}

std::vector<int> without_pose(const std::vector<std::optional<Rigid3>>& poses) {
  std::vector<int> frames;
  for (std::size_t f = 0; f < poses.size(); ++f)
    if (!poses[f]) frames.push_back(static_cast<int>(f));
  return frames;
}

namespace {

/// World_from_cam goes from that of one key frame to that of another at a steady pace, and on.
Rigid3 steady_motion(const Structure& structure, int from, int to, int frame) {
  const int a = structure.frames[from], b = structure.frames[to];
  return interpolate(structure.cam_from_world[from].inverse(),
                     structure.cam_from_world[to].inverse(),
                     static_cast<double>(frame - a) / (b - a))
      .inverse();
}

}  // namespace

Between between(const Structure& structure, const std::vector<int>& placed, int frame) {
  const auto frame_of = [&](int k) { return structure.frames[k]; };
  const auto after = std::ranges::lower_bound(placed, frame, {}, frame_of);
  Between found;
  if (after != placed.begin()) found.keyframes.push_back(*(after - 1));
  if (after != placed.end()) found.keyframes.push_back(*after);
  if (found.keyframes.size() < 2) {
    if (placed.size() < 2) return found;
    const bool at_start = after == placed.begin();
    const int outer = at_start ? placed[0] : placed.back();
    const int inner = at_start ? placed[1] : placed[placed.size() - 2];
    if (std::abs(frame - frame_of(outer)) <= std::abs(frame_of(outer) - frame_of(inner)))
      found.beyond = steady_motion(structure, inner, outer, frame);
    return found;
  }
  const int a = frame_of(found.keyframes[0]), b = frame_of(found.keyframes[1]);
  found.cam_from_world = steady_motion(structure, found.keyframes[0], found.keyframes[1], frame);
  if (frame - a > b - frame) std::swap(found.keyframes[0], found.keyframes[1]);
  return found;
}

}  // namespace rugae
