#pragma once
// What bundle adjustment minimises: Huber's loss of the re-projection errors.

#include <cmath>
#include <vector>

#include "recon/schur.h"
#include "recon/schur_blocks.h"

namespace rugae {

/// A point nearer to the camera's plane than this, in map units, or behind it has no error.
inline constexpr double kSchurMinDepth = 1e-9;

/// A pose as it is applied to many points.
struct SchurCamera {
  Mat3 rotation;
  Vec3 translation;
};

std::vector<SchurCamera> cameras_of(const std::vector<Rigid3>& cam_from_world);

/// Huber's rho of a squared residual, and its derivative.
struct HuberLoss {
  double value, weight;
};
inline HuberLoss huber(double squared, double width) {
  if (squared <= width * width) return {squared, 1.0};
  const double root = std::sqrt(squared);
  return {2.0 * width * root - width * width, width / root};
}

/// Half the sum of the losses, px^2; infinite where a point is behind a camera that sees it.
double cost_of(const SchurProblem& problem, const std::vector<SchurCamera>& cameras,
               const std::vector<Vec3>& positions, const PointParts& parts);

}  // namespace rugae
