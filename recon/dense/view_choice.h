#pragma once
// Which key frames get a depth map, and with which others each is compared.

#include <vector>

#include "recon/options.h"
#include "recon/structure.h"

namespace rugae {

struct StereoSet {
  int reference = -1;        // position in the list of key frames, like those below
  std::vector<int> sources;  // most useful first
};

/// How well two views triangulate a point: 1 at 5 degrees, falling to small angles, where depth is
/// uncertain, faster than to large ones, where a wall looks different (the weighting of MVSNet, Yao
/// et al., ECCV 2018, doi:10.1007/978-3-030-01237-3_47, section 4.1).
double triangulation_weight(double angle_rad);

/// Greedy: the key frame that sees most points still short of `depth_maps_a_point` depth maps comes
/// next, until none adds much or there are `max_depth_maps`. Its sources are those that see the
/// most of its points from a good angle and a like distance, points that few of the sources so far
/// see counting more. Key frames with fewer than two usable sources get none. By key frame.
std::vector<StereoSet> choose_views(const Structure& structure, const DenseOptions& options);

}  // namespace rugae
