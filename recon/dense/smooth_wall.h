#pragma once
// The wall between what is known of it.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "recon/dense/depth_map.h"

namespace rugae {

/// On the depth map's grid, CV_32F, everywhere.
struct SmoothWall {
  cv::Mat depth;
  cv::Mat sigma_share;  // standard deviation of the depth, over the depth
  cv::Mat cosine;       // of incidence
};

/// The least bent wall through the map's depths and the points. With rho = 1 / z, in which a plane
/// is straight, and differences of neighbouring cells of a few pixels each,
///   sum_known ((rho - rho_known) / s_known)^2 + sum ((rho - rho_prior) / s_prior)^2
///     + sum (rho_xx^2 + 2 rho_xy^2 + rho_yy^2) / (bend rho)^2
/// is minimised: Gauss-Newton, sparse Cholesky, Cauchy weights on all but the prior, so that what
/// is wrong has little say and a fold's edge may break the wall. Sigma is that of draws from the
/// solution's posterior. `prior`: for where nothing else says anything; `number` tells the maps'
/// draws apart. Empty where too little is known.
///
/// The light on the wall has no say: on mucosa its pattern changes the brightness between
/// neighbouring places by more than its shape does (docs/reconstruction.md).
std::optional<SmoothWall> smooth_wall(const DepthMap& map, const std::vector<SparseDepth>& points,
                                      const DepthPrior& prior, std::uint32_t number);

/// Lets the wall stand for what the map leaves open, where it is known to `sigma_share` of its
/// depth at least and seen within 60 degrees of its normal. Returns where (CV_8U).
cv::Mat fill_from(const SmoothWall& wall, double sigma_share, DepthMap& map);

}  // namespace rugae
