#pragma once
// Bundle adjustment: poses and points that together minimise the robust re-projection error.

#include <vector>

#include "core/rigid3.h"
#include "recon/options.h"
#include "recon/structure.h"

namespace rugae {

struct BundleReport {
  double initial_cost = 0.0, final_cost = 0.0;  // sum of Huber losses over 2, px^2
  int iterations = 0;
  int residuals = 0;  // observations
  bool converged = false;
  double radius = 0.0;  // of the damping, after the last step
};

/// What to adjust, and how far.
struct BundleScope {
  std::vector<int> free_keyframes;   // empty: all that are placed, the first of them held
  const SeenTracks* seen = nullptr;  // where the caller has it: not all tracks are looked through
  int max_iterations = 50;
  double function_tolerance = 1e-6;  // relative change of the cost at which to stop
  double radius = 1e4;               // of the damping, at the first step
};

/// Adjusts the placed key frames of the scope and every triangulated point they see (schur.h, Huber
/// loss of `huber_px`); other placed key frames that see those points are held. `focal_px` turns
/// rays into pixels. The result is the same for any number of threads.
BundleReport bundle_adjust(Structure& structure, double focal_px, const BundleOptions& options,
                           const BundleScope& scope);

/// Refines one pose on known points (rays[i] sees points[i], world). Returns the report.
BundleReport refine_pose(Rigid3& cam_from_world, const std::vector<Vec3>& points,
                         const std::vector<Vec2>& rays, double focal_px, double huber_px,
                         int max_iterations);

/// Re-projection error in px; infinite behind the camera.
double reprojection_px(const Rigid3& cam_from_world, const Vec3& point, const Vec2& ray,
                       double focal_px);

}  // namespace rugae
