#pragma once
// A first guess of a dense flow from sparse correspondences.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "recon/align.h"

namespace rugae {

/// CV_32FC2 of `size`: the displacements to[i] - from[i] at from[i], times `scale`, blended over
/// the image on a coarse grid (Shepard's weights (d^2 + s^2)^-2, s a twelfth of the width). Empty
/// for fewer than `kMinGuessPoints`.
cv::Mat guess_flow(const std::vector<Vec2>& from, const std::vector<Vec2>& to, double scale,
                   cv::Size size);

inline constexpr int kMinGuessPoints = 8;

/// The flow from pair.moving to the frame `next` when the motion of the pair goes on at its speed.
cv::Mat continued(const PairAlignment& pair, int next, cv::Size size);
/// The flow from pair.reference likewise.
cv::Mat continued_from(const PairAlignment& pair, int next, cv::Size size);

}  // namespace rugae
