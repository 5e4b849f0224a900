#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/pipelines/registration/TransformationEstimation.h>

#include <cmath>

#include "core/check.h"
#include "core/one_thread.h"
#include "validate/align.h"

namespace rugae {
void IcpOptions::check() const {
  rugae::check(max_distance_mm > 0.0, "icp: max_distance_mm is {}, expected above 0",
               max_distance_mm);
  rugae::check(max_iterations > 0, "icp: max_iterations is {}, expected above 0", max_iterations);
}

IcpResult icp(const std::vector<Vec3>& source, const std::vector<Vec3>& target,
              const IcpOptions& options) {
  options.check();
  IcpResult result;
  if (source.size() < 3 || target.size() < 3) return result;
  // Open3D gathers its pairs in the order in which threads finish, so sums over them differ in the
  // last bits; with one thread they do not.
  const OneOpenMpThread one_thread;
  const open3d::geometry::PointCloud moving(source), fixed(target);
  namespace reg = open3d::pipelines::registration;
  constexpr double kStill = 1e-7;  // relative change of RMSE and fitness: far below any metric
  const reg::RegistrationResult found =
      reg::RegistrationICP(moving, fixed, options.max_distance_mm, Mat4::Identity(),
                           reg::TransformationEstimationPointToPoint(options.with_scale),
                           reg::ICPConvergenceCriteria(kStill, kStill, options.max_iterations));
  const Mat3 linear = found.transformation_.topLeftCorner<3, 3>();
  const double scale = std::cbrt(linear.determinant());
  constexpr double kScaleRange = 2.0;
  if (found.correspondence_set_.size() < 3 || !(scale <= kScaleRange) ||
      !(scale >= 1.0 / kScaleRange))
    return result;
  result.target_from_source.scale = options.with_scale ? scale : 1.0;
  result.target_from_source.rotation = Quat(Mat3(linear / scale)).normalized();
  result.target_from_source.translation = found.transformation_.topRightCorner<3, 1>();
  result.rmse_mm = found.inlier_rmse_;
  result.used_share = found.fitness_;
  result.converged = true;
  return result;
}

}  // namespace rugae
