#pragma once
// How bright places of the wall look from where they are seen.

#include <vector>

#include "cameras/emitter.h"
#include "recon/dense/wall_patch.h"

namespace rugae {

/// A place of the wall in a key frame.
struct LightSight {
  int track = -1, keyframe = -1;      // places in Structure::tracks, Structure::frames
  double ln_level = 0.0;              // of linear light
  Vec3 p_cam;                         // when its row was read, map units
  Vec3 normal_cam;                    // unit, towards the camera
  Vec3 tangent_x_cam, tangent_y_cam;  // unit, the same two of the wall in every key frame
  double normal_sigma_rad = 0.0;
  Vec2 off_axis = Vec2::Zero();  // in the picture, from the principal point, over half the diagonal
};

/// Of all patches in all key frames that hold their tracks: the mean of the channel that a wet red
/// wall is brightest in around the place, where neither a reflection nor the end of the levels is.
/// Ascending tracks.
std::vector<LightSight> light_sights(const FrameSource& frames, const Structure& structure,
                                     const std::vector<WallPatch>& patches,
                                     const ReflectionOptions& reflections);

}  // namespace rugae
