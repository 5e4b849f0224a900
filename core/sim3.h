#pragma once
// Similarity transforms and their closed-form estimation from point pairs.

#include <optional>
#include <vector>

#include "core/rigid3.h"

namespace rugae {

/// x -> s R x + t.
struct Sim3 {
  double scale = 1.0;
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();

  Vec3 operator*(const Vec3& p) const { return scale * (rotation * p) + translation; }
  Sim3 operator*(const Sim3& b) const {
    return {scale * b.scale, (rotation * b.rotation).normalized(),
            scale * (rotation * b.translation) + translation};
  }
  /// Moves a pose: the position as a point, the orientation by the rotation alone.
  Rigid3 operator*(const Rigid3& pose) const {
    return {(rotation * pose.rotation).normalized(), *this * pose.translation};
  }
  Sim3 inverse() const {
    const Quat q = rotation.conjugate();
    return {1.0 / scale, q, -(q * translation) / scale};
  }
};

/// The transform target_from_source that minimises sum |target_i - T source_i|^2, over Sim(3), or
/// over SE(3) when `with_scale` is false (scale stays 1). Empty when fewer than three pairs are
/// given, when a coordinate is not finite, or when the source points lie on one line or in one
/// place, so that the rotation is not determined. Umeyama, Least-squares estimation of
/// transformation parameters between two point patterns, TPAMI 1991, eq. 40 to 43,
/// doi:10.1109/34.88573.
std::optional<Sim3> umeyama(const std::vector<Vec3>& source, const std::vector<Vec3>& target,
                            bool with_scale);

}  // namespace rugae
