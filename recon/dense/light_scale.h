#pragma once
// How long a unit of the map is, from light that does not come from the camera's centre.

#include <optional>
#include <vector>

#include "cameras/emitter.h"
#include "recon/dense/light_sights.h"

namespace rugae {

struct LightScale {
  double mm_per_unit = 0.0;
  double sigma_share = 0.0;  // standard deviation of mm_per_unit, as a share of it
  std::size_t sights = 0;
  double spread_ln = 0.0;  // standard deviation of ln light about the model, by its median
};

/// What a place receives from all emitters.
struct ReceivedLight {
  double ln = 0.0;
  Vec3 per_normal = Vec3::Zero();  // d ln / d normal_cam
};

/// One unit of the map being 1 / q mm:
///   ln sum_j I_j exp(-mu_j (1 - D_j . w_j)) cos theta_j / d_j^2,   d_j w_j = p_cam - q b_j
/// Empty where no emitter lights it.
std::optional<ReceivedLight> received_light(const LightSight& sight,
                                            const std::vector<Emitter>& lights, double q);

/// Least squares, with robust weights, over q and what is not known of wall and camera:
///   ln level = ln albedo(track) + ln gain(key frame) + ln light(q, normal(track))
///              + 4 ln cos(angle to the axis) + c_1 r^2 + c_2 r^4 + c_3 r^6
///              + c_4 ((1 - cos_in)^5 + (1 - cos_out)^5)
/// (4 ln cos: the natural fall-off, which follows the ray and not the pixel, docs/physics.md; r: in
/// the picture, the lens' fall-off beyond that; c_4: what a wet layer keeps from the wall, after
/// Schlick; normals stray from those of the patches by their own sigma, kLeastNormalSigmaRad at
/// least). Light tells how far the wall is only where it does not come from the camera's centre, so
/// that the distances to both differ.
///
/// The uncertainty has three parts. The jackknife's over stretches of the path where tracks begin:
/// neighbours share the errors of their normals and of the model. Since a light aside looks much
/// like a tilted wall, half the range of the answers as the normals are believed
/// kNormalSigmaFactor times more and less. And, since it looks much like a picture that is brighter
/// on one side (1.5 thousandths are 1 % of the length; a lens a little aside makes as much), half
/// of how the answer moves when the picture's light may have a slope. `sights` ascend by tracks.
/// Empty where no light is
/// beside the camera or where the answer is no more certain than kMostUncertain.
std::optional<LightScale> scale_from_light(const std::vector<LightSight>& sights,
                                           const std::vector<Emitter>& lights);

/// No tangent plane is better than this: what is between its points is not seen.
inline constexpr double kLeastNormalSigmaRad = 0.04;
inline constexpr double kNormalSigmaFactor = 3.0;
/// A map unit known no better than this is left a map unit.
inline constexpr double kMostUncertain = 0.2;

}  // namespace rugae
