#pragma once
// The solver of bundle adjustment: Levenberg and Marquardt's steps with the points eliminated.

#include <vector>

#include "core/rigid3.h"

namespace rugae {

/// Cameras and points that see each other.
struct SchurProblem {
  struct Observation {
    int camera = -1;  // of `cameras`
    Vec2 ray;         // (x/z, y/z)
  };
  struct Point {
    Vec3 position;
    std::vector<Observation> observations;  // ascending cameras
  };
  std::vector<Rigid3> cam_from_world;
  std::vector<char> is_free;  // of the cameras: 0 holds one where it is
  std::vector<Point> points;  // all free
  double focal_px = 1.0;
  double huber_px = 1.0;
};

struct SchurOptions {
  int max_iterations = 50;           // rejected steps count
  double function_tolerance = 1e-6;  // relative change of the cost at which to stop
  double radius = 1e4;               // of the first step; the damping is its inverse
};

struct SchurReport {
  double initial_cost = 0.0, final_cost = 0.0;  // infinite: a point is behind a camera
  int iterations = 0;
  bool converged = false;
  double radius = 0.0;  // after the last step
};

/// Minimises over free cameras and points
///   1/2 sum rho(|r|^2),   r = f ((p_x, p_y) / p_z - ray),   p = R X + t,
/// with Huber's rho. With the residuals' derivatives A by the camera and B by the point, weighted
/// by rho', and a damping D = diag / radius, the normal equations
///   [U W; W^T V] [dc; dp] = -[g_c; g_p],  U = A^T A + D,  W = A^T B,  V = B^T B + D
/// are solved through the Schur complement (Triggs, McLauchlan, Hartley, Fitzgibbon, Bundle
/// adjustment, a modern synthesis, 2000, doi:10.1007/3-540-44480-7_21, section 6.1)
///   (U - W V^-1 W^T) dc = -g_c + W V^-1 g_p,   dp = -V^-1 (g_p + W^T dc).
/// Ceres does the same several times slower, and on two threads its sums have no fixed order; here
/// they do, for any number of threads.
SchurReport minimise(SchurProblem& problem, const SchurOptions& options);

}  // namespace rugae
