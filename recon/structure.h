#pragma once
// Poses of the key frames and sparse points: tracks from the inlier correspondences, incremental
// start, bundle adjustment.

#include <vector>

#include "core/rigid3.h"
#include "recon/align.h"
#include "recon/options.h"

namespace rugae {

/// A wall point seen in several key frames.
struct Track {
  struct Observation {
    int keyframe = -1;  // position in the list of key frames, not the frame's index
    Vec2 pixel;
  };
  std::vector<Observation> observations;
  Vec3 point = Vec3::Zero();  // world, map units
  bool triangulated = false;
};

/// Key frame poses and points, in a world of arbitrary scale whose origin is the first key frame.
struct Structure {
  std::vector<int> frames;             // of the key frames, as selected
  std::vector<bool> placed;            // false: this key frame could not be placed
  std::vector<Rigid3> cam_from_world;  // of the key frames
  std::vector<Track> tracks;
  double mean_reprojection_px = 0.0;
  int iterations = 0;
  bool converged = false;
};

}  // namespace rugae
