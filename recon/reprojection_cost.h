#pragma once
// The residual of bundle adjustment and its derivatives. Includes Ceres: for .cpp files only.

#include <ceres/sized_cost_function.h>

#include "core/types.h"

namespace rugae {

/// Re-projection error in px of a world point in a camera: parameters are the pose cam_from_world
/// as (qx, qy, qz, qw, tx, ty, tz), a unit quaternion, and the point (X, Y, Z). With q = (v, w):
///   p = X + 2 w (v x X) + 2 (v (v . X) - X (v . v)) + t,     r = f ((p_x, p_y) / p_z - ray).
/// Derivatives follow from p as a polynomial in v and w:
///   dp/dv = -2 w [X]x + 2 ((v . X) I + v X^T - 2 X v^T),     dp/dw = 2 v x X,
///   dp/dX = I + 2 w [v]x + 2 (v v^T - (v . v) I),            dp/dt = I,
///   dr/dp = f / p_z [1 0 -p_x/p_z; 0 1 -p_y/p_z].
class ReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const Vec2& ray, double focal_px) : ray_(ray), focal_px_(focal_px) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    return evaluate(parameters[0], Eigen::Map<const Vec3>(parameters[1]), residuals,
                    jacobians != nullptr ? jacobians[0] : nullptr,
                    jacobians != nullptr ? jacobians[1] : nullptr);
  }

  bool evaluate(const double* pose, const Vec3& point, double* residuals, double* by_pose,
                double* by_point) const {
    const Vec3 v(pose[0], pose[1], pose[2]);
    const double w = pose[3];
    const Vec3 v_cross_x = v.cross(point);
    const double v_dot_x = v.dot(point), v_dot_v = v.squaredNorm();
    const Vec3 p = point + 2.0 * w * v_cross_x + 2.0 * (v * v_dot_x - point * v_dot_v) +
                   Vec3(pose[4], pose[5], pose[6]);
    if (!(p.z() > kMinDepth)) return false;  // behind the camera: the step is refused
    const double inverse_z = 1.0 / p.z();
    const double x = p.x() * inverse_z, y = p.y() * inverse_z;
    residuals[0] = focal_px_ * (x - ray_.x());
    residuals[1] = focal_px_ * (y - ray_.y());
    Eigen::Matrix<double, 2, 3> by_p;
    by_p << 1.0, 0.0, -x, 0.0, 1.0, -y;
    by_p *= focal_px_ * inverse_z;
    if (by_pose != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> j(by_pose);
      const Mat3 by_v =
          -2.0 * w * cross_matrix(point) +
          2.0 * (v_dot_x * Mat3::Identity() + v * point.transpose() - 2.0 * point * v.transpose());
      j.leftCols<3>() = by_p * by_v;
      j.col(3) = by_p * (2.0 * v_cross_x);
      j.rightCols<3>() = by_p;
    }
    if (by_point != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(by_point);
      j = by_p * (Mat3::Identity() + 2.0 * w * cross_matrix(v) +
                  2.0 * (v * v.transpose() - v_dot_v * Mat3::Identity()));
    }
    return true;
  }

 private:
  static constexpr double kMinDepth = 1e-9;  // map units
  static Mat3 cross_matrix(const Vec3& a) {
    Mat3 m;
    m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    return m;
  }
  Vec2 ray_;
  double focal_px_;
};

/// The same with the point held: for a single pose.
class PoseCost final : public ceres::SizedCostFunction<2, 7> {
 public:
  PoseCost(const Vec2& ray, double focal_px, const Vec3& point)
      : cost_(ray, focal_px), point_(point) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    return cost_.evaluate(parameters[0], point_, residuals,
                          jacobians != nullptr ? jacobians[0] : nullptr, nullptr);
  }

 private:
  ReprojectionCost cost_;
  Vec3 point_;
};

}  // namespace rugae
