#include "core/sim3.h"

#include <Eigen/SVD>

#include "core/check.h"

namespace rugae {

std::optional<Sim3> umeyama(const std::vector<Vec3>& source, const std::vector<Vec3>& target,
                            bool with_scale) {
  check(source.size() == target.size(), "umeyama: {} source points and {} target points",
        source.size(), target.size());
  if (source.size() < 3) return std::nullopt;
  const double n = static_cast<double>(source.size());
  Vec3 mean_source = Vec3::Zero(), mean_target = Vec3::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    mean_source += source[i];
    mean_target += target[i];
  }
  mean_source /= n;
  mean_target /= n;

  double variance_source = 0.0;
  Mat3 covariance = Mat3::Zero(), scatter_source = Mat3::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Vec3 s = source[i] - mean_source;
    variance_source += s.squaredNorm() / n;
    covariance += (target[i] - mean_target) * s.transpose() / n;
    scatter_source += s * s.transpose() / n;
  }
  if (!covariance.allFinite() || !(variance_source > 0.0)) return std::nullopt;

  // On a line the rotation about it is free: the second principal spread must stand above rounding.
  const Vec3 spread = Eigen::JacobiSVD<Mat3>(scatter_source).singularValues();
  constexpr double kLineRatio = 1e-12;  // variances; 1e-6 in length
  if (!(spread[1] > kLineRatio * spread[0])) return std::nullopt;

  const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 sign = Vec3::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) sign[2] = -1.0;
  Sim3 result;
  result.rotation = Quat(Mat3(svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose()));
  result.rotation.normalize();
  if (with_scale) result.scale = svd.singularValues().dot(sign) / variance_source;
  if (!(result.scale > 0.0)) return std::nullopt;
  result.translation = mean_target - result.scale * (result.rotation * mean_source);
  return result;
}

}  // namespace rugae
