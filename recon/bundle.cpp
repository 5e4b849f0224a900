#include "recon/bundle.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "recon/reprojection_cost.h"
#include "recon/schur.h"

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
  o.num_threads = 1;  // one thread, one order of sums
  o.max_num_iterations = max_iterations;
  o.function_tolerance = function_tolerance;
  o.gradient_tolerance = 1e-14;   // the function tolerance decides
  o.parameter_tolerance = 1e-14;  // likewise
  o.logging_type = ceres::SILENT;
  o.max_num_consecutive_invalid_steps = 10;
  return o;
}

// All tracks that may be adjusted, in order, and perhaps others.
std::vector<std::size_t> candidates(const Structure& structure, const BundleScope& scope) {
  std::vector<std::size_t> tracks;
  if (scope.seen == nullptr || scope.free_keyframes.empty()) {
    tracks.resize(structure.tracks.size());
    std::iota(tracks.begin(), tracks.end(), std::size_t{0});
    return tracks;
  }
  for (const int k : scope.free_keyframes) {
    const std::vector<std::size_t>& of = (*scope.seen)[static_cast<std::size_t>(k)];
    tracks.insert(tracks.end(), of.begin(), of.end());
  }
  std::ranges::sort(tracks);
  tracks.erase(std::unique(tracks.begin(), tracks.end()), tracks.end());
  return tracks;
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

  SchurProblem problem;
  problem.focal_px = focal_px;
  problem.huber_px = options.huber_px;
  std::vector<int> camera_of(n, -1), keyframe_of;  // of the problem; of the structure
  std::vector<Track*> adjusted;
  BundleReport report;
  for (const std::size_t t : candidates(structure, scope)) {
    Track& track = structure.tracks[t];
    if (!track.triangulated) continue;
    const auto counts = [&](const Track::Observation& o) {
      return o.inlier && structure.placed[o.keyframe];
    };
    if (std::ranges::none_of(track.observations,
                             [&](const auto& o) { return counts(o) && is_free[o.keyframe]; }))
      continue;
    SchurProblem::Point point{track.point, {}};
    for (const auto& o : track.observations)
      if (counts(o)) point.observations.push_back({o.keyframe, o.ray});
    std::ranges::sort(point.observations, {}, &SchurProblem::Observation::camera);
    for (const auto& o : point.observations) camera_of[o.camera] = 0;
    report.residuals += static_cast<int>(point.observations.size());
    problem.points.push_back(std::move(point));
    adjusted.push_back(&track);
  }
  if (adjusted.empty()) return report;
  for (std::size_t k = 0; k < n; ++k) {  // the key frames that see any of the points
    if (camera_of[k] < 0) continue;
    camera_of[k] = static_cast<int>(keyframe_of.size());
    keyframe_of.push_back(static_cast<int>(k));
    problem.cam_from_world.push_back(structure.cam_from_world[k]);
    problem.is_free.push_back(static_cast<char>(is_free[k]));
  }
  for (SchurProblem::Point& point : problem.points)
    for (auto& o : point.observations) o.camera = camera_of[o.camera];

  const SchurReport found =
      minimise(problem, {scope.max_iterations, scope.function_tolerance, scope.radius});
  report.initial_cost = found.initial_cost;
  report.final_cost = found.final_cost;
  report.iterations = found.iterations;
  report.converged = found.converged;
  report.radius = found.radius;
  for (std::size_t c = 0; c < keyframe_of.size(); ++c)
    structure.cam_from_world[keyframe_of[c]] = problem.cam_from_world[c];
  for (std::size_t i = 0; i < adjusted.size(); ++i) adjusted[i]->point = problem.points[i].position;
  return report;
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
