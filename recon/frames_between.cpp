#include "recon/frames_between.h"

#include <algorithm>
#include <array>
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

struct Posed {
  int frame;
  Rigid3 cam_from_world;
};

/// World_from_cam goes from one to the other at a steady pace, and on.
Rigid3 steady_motion(const Posed& a, const Posed& b, int frame) {
  return interpolate(a.cam_from_world.inverse(), b.cam_from_world.inverse(),
                     static_cast<double>(frame - a.frame) / (b.frame - a.frame))
      .inverse();
}

Rigid3 steady_motion(const Structure& structure, int from, int to, int frame) {
  return steady_motion({structure.frames[from], structure.cam_from_world[from]},
                       {structure.frames[to], structure.cam_from_world[to]}, frame);
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

std::vector<Rigid3> beside_frames(const std::vector<std::optional<Rigid3>>& cam_from_world,
                                  int frame) {
  // The nearest two on either side.
  const auto nearest = [&](int step) {
    std::vector<Posed> found;
    const int n = static_cast<int>(cam_from_world.size());
    for (int f = frame + step; f >= 0 && f < n && found.size() < 2; f += step)
      if (const auto& pose = cam_from_world[static_cast<std::size_t>(f)])
        found.push_back({f, *pose});
    return found;
  };
  const std::array<std::vector<Posed>, 2> sides = {nearest(-1), nearest(1)};
  std::vector<Rigid3> places;
  if (!sides[0].empty() && !sides[1].empty())
    places.push_back(steady_motion(sides[0][0], sides[1][0], frame));
  for (const std::vector<Posed>& side : sides)
    if (side.size() == 2 &&
        std::abs(frame - side[0].frame) <= std::abs(side[0].frame - side[1].frame))
      places.push_back(steady_motion(side[1], side[0], frame));
  for (const std::vector<Posed>& side : sides)
    if (!side.empty()) places.push_back(side[0].cam_from_world);
  return places;
}

}  // namespace rugae
