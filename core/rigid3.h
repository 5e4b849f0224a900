#pragma once
// Rigid motions of space. Names carry frames: cam_from_world * p_world = p_cam.

#include "core/types.h"

namespace rugae {

/// x -> R x + t, with R a unit quaternion and t in mm.
struct Rigid3 {
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();

  Rigid3() = default;
  Rigid3(const Quat& q, const Vec3& t) : rotation(q), translation(t) {}
  Rigid3(const Mat3& r, const Vec3& t) : rotation(r), translation(t) {}

  Vec3 operator*(const Vec3& p) const { return rotation * p + translation; }
  Rigid3 operator*(const Rigid3& b) const {
    return {(rotation * b.rotation).normalized(), rotation * b.translation + translation};
  }
  Rigid3 inverse() const {
    const Quat q = rotation.conjugate();
    return {q, -(q * translation)};
  }
  /// Rows 1 to 3 of the homogeneous matrix: [R | t].
  Eigen::Matrix<double, 3, 4> matrix3x4() const {
    Eigen::Matrix<double, 3, 4> m;
    m << rotation.toRotationMatrix(), translation;
    return m;
  }
};

/// The angle of the rotation that takes a to b, in [0, pi].
inline double angle_between_rad(const Quat& a, const Quat& b) { return a.angularDistance(b); }

/// Translation linearly, rotation on the shortest great arc; fraction in [0, 1].
inline Rigid3 interpolate(const Rigid3& a, const Rigid3& b, double fraction) {
  return {a.rotation.slerp(fraction, b.rotation),
          (1.0 - fraction) * a.translation + fraction * b.translation};
}

}  // namespace rugae
