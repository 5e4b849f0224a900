#pragma once
// Frames that are no key frames, and the placed key frames that they lie between.

#include <optional>
#include <vector>

#include "core/rigid3.h"
#include "recon/structure.h"

namespace rugae {

/// Places in Structure::frames, ascending.
std::vector<int> placed_keyframes(const Structure& structure);

/// Of `frames` frames, cam_from_world: those of placed key frames, the others empty.
std::vector<std::optional<Rigid3>> keyframe_poses(const Structure& structure, int frames);

/// The frames that have no pose.
std::vector<int> without_pose(const std::vector<std::optional<Rigid3>>& poses);

/// What a frame lies between.
struct Between {
  std::vector<int> keyframes;            // before and after, the nearer one first; one at an end
  std::optional<Rigid3> cam_from_world;  // on the way from one to the other; empty at an end
  /// At an end: where the motion between its two outermost key frames leads. Empty with one alone,
  /// or farther on than they are apart.
  std::optional<Rigid3> beyond;
};

/// `placed` as placed_keyframes() gives it, not empty.
Between between(const Structure& structure, const std::vector<int>& placed, int frame);

/// Where the camera may be, the likelier first: on its way between the nearest frames before and
/// after that have a pose; where the motion of the two nearest on either side leads, no farther on
/// than they are apart; where these nearest frames are.
std::vector<Rigid3> beside_frames(const std::vector<std::optional<Rigid3>>& cam_from_world,
                                  int frame);

}  // namespace rugae
