#pragma once
// The capsule's distance to a wall that moves.

#include <string>

#include "core/pose_track.h"
#include "scenes/scene.h"

namespace rugae {

/// Checks every pose of the track against the wall as it is at the pose's time. Throws Error naming
/// `name`, the first frame and its time where the camera's centre is outside or nearer than
/// `clearance_mm`, and the distance found. A scene without motion always passes.
void check_moving_clearance(const Scene& scene, const PoseTrack& track, double clearance_mm,
                            const std::string& name);

}  // namespace rugae
