#pragma once
// The vector types everyone shares, and the few constants of nature and geometry.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rugae {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec4 = Eigen::Vector4d;
using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Vec3i = Eigen::Vector3i;
using Mat2 = Eigen::Matrix2d;
using Mat3 = Eigen::Matrix3d;
using Mat4 = Eigen::Matrix4d;
using Quat = Eigen::Quaterniond;

}  // namespace rugae
