#include "recon/bundle.h"

#include <ceres/ceres.h>

#include <array>
#include <limits>

#include "recon/reprojection_cost.h"

namespace rugae {
namespace {

using PoseBlock = std::array<double, 7>;
using PoseManifold =
    ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;

PoseBlock to_block(const Rigid3& pose) {
  const auto& q = pose.rotation.coeffs();
  const Vec3& t = pose.translation;
  return {q[0], q[1], q[2], q[3], t[0], t[1], t[2]};
}

Rigid3 from_block(const PoseBlock& b) {
  return {Quat(b[3], b[0], b[1], b[2]).normalized(), Vec3(b[4], b[5], b[6])};
}

ceres::Solver::Options solver_options(int max_iterations, double function_tolerance) {
  ceres::Solver::Options o;
  o.num_threads =
      1;  // the Schur eliminator adds in the order of its threads: one thread, one order
  o.max_num_iterations = max_iterations;
  o.function_tolerance = function_tolerance;
  o.gradient_tolerance = 1e-14;   // the function tolerance decides
  o.parameter_tolerance = 1e-14;  // likewise
  o.logging_type = ceres::SILENT;
  o.max_num_consecutive_invalid_steps = 10;
  return o;
}

BundleReport report_of(const ceres::Solver::Summary& summary) {
  BundleReport report;
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  report.iterations = static_cast<int>(summary.iterations.size());
  report.residuals = summary.num_residuals / 2;
  report.converged = summary.termination_type == ceres::CONVERGENCE;
  return report;
}

}  // namespace

double reprojection_px(const Rigid3& cam_from_world, const Vec3& point, const Vec2& ray,
                       double focal_px) {
  const Vec3 p_cam = cam_from_world * point;
  if (!(p_cam.z() > 0.0)) return std::numeric_limits<double>::infinity();
  return focal_px * (p_cam.head<2>() / p_cam.z() - ray).norm();
}

BundleReport bundle_adjust(Structure& structure, double focal_px, const BundleOptions& options,
                           const BundleScope& scope) {
  const std::size_t n = structure.frames.size();
  std::vector<int> is_free(n, 0);
  if (scope.free_keyframes.empty()) {
    bool first = true;
    for (std::size_t k = 0; k < n; ++k) {
      if (!structure.placed[k]) continue;
      is_free[k] = !first;
      first = false;
    }
  } else {
    for (const int k : scope.free_keyframes) is_free[k] = structure.placed[k];
  }

  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  PoseManifold manifold;
  ceres::HuberLoss loss(options.huber_px);
  ceres::Problem problem(problem_options);
  std::vector<PoseBlock> poses(n);
  for (std::size_t k = 0; k < n; ++k) poses[k] = to_block(structure.cam_from_world[k]);

  auto* ordering = new ceres::ParameterBlockOrdering;  // owned by the solver's options below
  std::vector<char> used(n, 0);
  for (Track& track : structure.tracks) {
    if (!track.triangulated) continue;
    bool seen_free = false;
    for (const auto& o : track.observations)
      seen_free = seen_free || (o.inlier && structure.placed[o.keyframe] && is_free[o.keyframe]);
    if (!seen_free) continue;
    for (const auto& o : track.observations) {
      if (!o.inlier || !structure.placed[o.keyframe]) continue;
      problem.AddResidualBlock(new ReprojectionCost(o.ray, focal_px), &loss,
                               poses[o.keyframe].data(), track.point.data());
      used[o.keyframe] = 1;
    }
    ordering->AddElementToGroup(track.point.data(), 0);
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (!used[k]) continue;
    problem.SetManifold(poses[k].data(), &manifold);
    if (!is_free[k]) problem.SetParameterBlockConstant(poses[k].data());
    ordering->AddElementToGroup(poses[k].data(), 1);
  }
  ceres::Solver::Options solver = solver_options(scope.max_iterations, scope.function_tolerance);
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering.reset(ordering);
  if (problem.NumResidualBlocks() == 0) return {};
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable()) return report_of(summary);
  for (std::size_t k = 0; k < n; ++k)
    if (used[k] && is_free[k]) structure.cam_from_world[k] = from_block(poses[k]);
  return report_of(summary);
}

BundleReport refine_pose(Rigid3& cam_from_world, const std::vector<Vec3>& points,
                         const std::vector<Vec2>& rays, double focal_px, double huber_px,
                         int max_iterations) {
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  PoseManifold manifold;
  ceres::HuberLoss loss(huber_px);
  ceres::Problem problem(problem_options);
  PoseBlock pose = to_block(cam_from_world);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!((cam_from_world * points[i]).z() > 0.0)) continue;
    problem.AddResidualBlock(new PoseCost(rays[i], focal_px, points[i]), &loss, pose.data());
  }
  if (problem.NumResidualBlocks() < 3) return {};
  problem.SetManifold(pose.data(), &manifold);
  ceres::Solver::Options solver = solver_options(max_iterations, 1e-12);
  solver.linear_solver_type = ceres::DENSE_QR;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (summary.IsSolutionUsable()) cam_from_world = from_block(pose);
  return report_of(summary);
}

}  // namespace rugae
