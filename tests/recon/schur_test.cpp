// The bundle adjustment's solver against Ceres, on the same problem.

#include "recon/schur.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>

#include "core/random.h"
#include "recon/reprojection_cost.h"
#include "synthetic.h"

namespace rugae {
namespace {

// Noisy rays, some of them far off, poses and points a little beside the truth; camera 0 is held.
SchurProblem noisy_problem() {
  const synthetic::World world = synthetic::make_world({.cameras = 10, .noise_px = 0.5});
  SchurProblem problem;
  problem.focal_px = world.lens.fx;
  for (std::size_t k = 0; k < world.cam_from_world.size(); ++k) {
    const auto g = random_normal(1, Purpose::test, 31, k);
    const Rigid3 beside(Quat(Eigen::AngleAxisd(0.01, Vec3(g[0], g[1], g[2]).normalized())),
                        0.1 * Vec3(g[1], g[2], g[3]));
    problem.is_free.push_back(k > 0);
    problem.cam_from_world.push_back(k > 0 ? beside * world.cam_from_world[k]
                                           : world.cam_from_world[k]);
  }
  for (std::size_t i = 0; i < world.tracks.size(); ++i) {
    const auto g = random_normal(1, Purpose::test, 32, i);
    SchurProblem::Point point{world.points[i] + 0.1 * Vec3(g[0], g[1], g[2]), {}};
    for (const auto& o : world.tracks[i].observations)
      point.observations.push_back({o.keyframe, o.ray});
    if (i % 10 == 0) point.observations[0].ray += Vec2(0.05, 0.02);  // beyond Huber's width
    problem.points.push_back(point);
  }
  return problem;
}

double solve_with_ceres(SchurProblem& problem) {
  ceres::HuberLoss loss(problem.huber_px);
  ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>> manifold;
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(options);
  std::vector<std::array<double, 7>> poses;
  for (const Rigid3& pose : problem.cam_from_world) {
    const auto& q = pose.rotation.coeffs();
    const Vec3& t = pose.translation;
    poses.push_back({q[0], q[1], q[2], q[3], t[0], t[1], t[2]});
  }
  for (SchurProblem::Point& point : problem.points)
    for (const auto& o : point.observations)
      ceres_problem.AddResidualBlock(new ReprojectionCost(o.ray, problem.focal_px), &loss,
                                     poses[o.camera].data(), point.position.data());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    ceres_problem.SetManifold(poses[k].data(), &manifold);
    if (!problem.is_free[k]) ceres_problem.SetParameterBlockConstant(poses[k].data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.function_tolerance = 1e-12;
  solver.max_num_iterations = 100;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  for (std::size_t k = 0; k < poses.size(); ++k)
    problem.cam_from_world[k] =
        Rigid3(Quat(poses[k][3], poses[k][0], poses[k][1], poses[k][2]).normalized(),
               Vec3(poses[k][4], poses[k][5], poses[k][6]));
  return summary.final_cost;
}

TEST(Schur, FindsTheMinimumOfCeres) {
  SchurProblem ours = noisy_problem(), theirs = ours;
  const SchurReport report = minimise(ours, {.max_iterations = 100, .function_tolerance = 1e-12});
  const double ceres_cost = solve_with_ceres(theirs);
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.final_cost, 0.1 * report.initial_cost);
  EXPECT_NEAR(report.final_cost, ceres_cost, 1e-8 * ceres_cost);
  // One camera is held but no length is: along a change of scale the cost is flat, so shapes are
  // compared, by distances over the distance between two cameras.
  const auto distance = [](const SchurProblem& p, int a, int b) {
    return (p.cam_from_world[a].inverse().translation - p.cam_from_world[b].inverse().translation)
        .norm();
  };
  for (int k = 1; k < 9; ++k)
    EXPECT_NEAR(distance(ours, 0, k) / distance(ours, 0, 9),
                distance(theirs, 0, k) / distance(theirs, 0, 9), 1e-5)
        << k;
}

TEST(Schur, SameForAnyNumberOfThreads) {
  SchurProblem many = noisy_problem(), single = many;
  // Enough points for several parts.
  for (int copy = 0; copy < 3; ++copy) {
    const auto points = noisy_problem().points;
    many.points.insert(many.points.end(), points.begin(), points.end());
  }
  single.points = many.points;
  const SchurReport a = minimise(many, {});
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const SchurReport b = minimise(single, {});
  EXPECT_EQ(a.final_cost, b.final_cost);
  for (std::size_t k = 0; k < many.cam_from_world.size(); ++k)
    EXPECT_EQ(many.cam_from_world[k].translation, single.cam_from_world[k].translation);
  for (std::size_t i = 0; i < many.points.size(); ++i)
    EXPECT_EQ(many.points[i].position, single.points[i].position);
}

TEST(Schur, APointBehindACameraIsNoStart) {
  SchurProblem problem = noisy_problem();
  problem.points[0].position = problem.cam_from_world[0].inverse() * Vec3(0.0, 0.0, -1.0);
  problem.points[0].observations = {{0, Vec2::Zero()}, {1, Vec2::Zero()}};
  const std::vector<Rigid3> before = problem.cam_from_world;
  const SchurReport report = minimise(problem, {});
  EXPECT_FALSE(std::isfinite(report.initial_cost));
  EXPECT_FALSE(report.converged);
  for (std::size_t k = 0; k < before.size(); ++k)
    EXPECT_EQ(problem.cam_from_world[k].translation, before[k].translation);
}

}  // namespace
}  // namespace rugae
