#pragma once
// Closed cavities with known shapes, and what a path in them is measured by.

#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/pose_track.h"
#include "trajectories/trajectory.h"

namespace rugae {

/// Outward normals; semi-axes in mm.
TriangleMesh ellipsoid(const Vec3& semi_axes_mm, const Vec3& center_mm = Vec3::Zero());
/// A tube of the radius around an arc in the xy plane, closed by half spheres: like a stomach bent
/// to a J. The arc's radius must exceed the tube's.
TriangleMesh bent_tube(double tube_radius_mm, double arc_radius_mm, double arc_rad);
/// 60 x 48 x 45 mm and a tube of 32 mm around an arc of 75 mm over 110 degrees.
TriangleMesh test_ellipsoid();
TriangleMesh test_tube();

/// Distance of the wall along the camera's axis, mm, by steps as long as the distance to the wall
/// allows.
double view_distance_mm(const ClosestPoint& wall, const Rigid3& world_from_camera);

struct PathMotion {
  double mean_mm = 0.0, max_mm = 0.0;    // between neighbouring poses
  double mean_deg = 0.0, max_deg = 0.0;  // turn between them
};
PathMotion motion_of(const PoseTrack& track);

/// Pairs of poses more than `apart_mm` of way from each other that are closer than `near_mm` and
/// look within `similar_deg` of each other.
int revisits(const PoseTrack& track, double apart_mm, double near_mm, double similar_deg);

}  // namespace rugae
