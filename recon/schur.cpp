#include "recon/schur.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "recon/schur_blocks.h"
#include "recon/schur_cost.h"

namespace rugae {
namespace {

constexpr double kLargestRadius = 1e16, kSmallestRadius = 1e-32;
constexpr double kMinDiagonal = 1e-6, kMaxDiagonal = 1e32;  // of what the damping scales with
constexpr double kMinQuality = 1e-3;           // of the gain that the quadratic model promises
constexpr double kParameterTolerance = 1e-14;  // relative step: nothing moves any more
constexpr int kMaxRefusals = 10;               // steps in a row that lead behind a camera

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Mat63 = Eigen::Matrix<double, 6, 3>;
using Mat26 = Eigen::Matrix<double, 2, 6>;
using Mat23 = Eigen::Matrix<double, 2, 3>;

// What the cameras' equations are summed from, in one part of the points.
struct CameraSums {
  std::vector<Mat6> u, outer;  // A^T A of each camera; W V^-1 W^T of each block
  std::vector<Vec6> g, shift;  // A^T r; W V^-1 g_p
  CameraSums(int free, std::size_t blocks)
      : u(free, Mat6::Zero()),
        outer(blocks, Mat6::Zero()),
        g(free, Vec6::Zero()),
        shift(free, Vec6::Zero()) {}
  void clear() {
    std::ranges::fill(u, Mat6::Zero());
    std::ranges::fill(g, Vec6::Zero());
    clear_eliminated();
  }
  void clear_eliminated() {
    std::ranges::fill(outer, Mat6::Zero());
    std::ranges::fill(shift, Vec6::Zero());
  }
};

// One point's own equations.
struct PointEquations {
  Mat3 v;  // B^T B
  Vec3 g;  // B^T r
  Mat3 inverse;
  std::size_t first;  // of its observations among all
};

Vec6 damping(const Mat6& m) { return m.diagonal().cwiseMax(kMinDiagonal).cwiseMin(kMaxDiagonal); }
Vec3 damping(const Mat3& m) { return m.diagonal().cwiseMax(kMinDiagonal).cwiseMin(kMaxDiagonal); }

class Solver {
 public:
  explicit Solver(SchurProblem& problem)
      : problem_(problem),
        parts_(problem.points.size()),
        slot_of_(number_free(problem)),
        pattern_(problem, slot_of_, static_cast<int>(free_cameras(problem).size())),
        camera_of_(free_cameras(problem)),
        sums_(parts_.count, CameraSums(pattern_.free(), pattern_.blocks().size())),
        equations_(problem.points.size()),
        u_(pattern_.free()),
        g_(pattern_.free()) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < problem.points.size(); ++i) {
      equations_[i].first = first;
      first += problem.points[i].observations.size();
    }
    w_.resize(first);
  }

  SchurReport run(const SchurOptions& options);

 private:
  static std::vector<int> free_cameras(const SchurProblem& problem) {
    std::vector<int> free;
    for (int c = 0; c < static_cast<int>(problem.is_free.size()); ++c)
      if (problem.is_free[c]) free.push_back(c);
    return free;
  }
  static std::vector<int> number_free(const SchurProblem& problem) {
    std::vector<int> slot(problem.is_free.size(), -1);
    int next = 0;
    for (std::size_t c = 0; c < slot.size(); ++c)
      if (problem.is_free[c]) slot[c] = next++;
    return slot;
  }

  void linearise(const std::vector<SchurCamera>& cameras);
  bool eliminate(double radius);
  bool solve_cameras(double radius, Eigen::VectorXd& step);
  void solve_points(const Eigen::VectorXd& camera_step, std::vector<Vec3>& step) const;
  double promised(const Eigen::VectorXd& camera_step, const std::vector<Vec3>& point_step,
                  double radius) const;
  bool nothing_moves(const Eigen::VectorXd& camera_step, const std::vector<Vec3>& point_step) const;

  SchurProblem& problem_;
  PointParts parts_;
  std::vector<int> slot_of_;
  BlockPattern pattern_;
  std::vector<int> camera_of_;
  std::vector<CameraSums> sums_;
  std::vector<PointEquations> equations_;
  std::vector<Mat63> w_;  // of all observations, point by point
  std::vector<Mat6> u_;
  std::vector<Vec6> g_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper> factor_;
  bool analysed_ = false;
};

// A camera's step (w, dt) turns R into exp([w]x) R and adds dt to t:
//   dp/dw = -[R X]x,   dp/dt = I,   dp/dX = R,   dr/dp = f / p_z [1 0 -p_x/p_z; 0 1 -p_y/p_z].
void Solver::linearise(const std::vector<SchurCamera>& cameras) {
  parts_.each([&](std::size_t part) {
    CameraSums& sums = sums_[part];
    sums.clear();
    for (std::size_t i = parts_.begin(part); i < parts_.begin(part + 1); ++i) {
      const SchurProblem::Point& point = problem_.points[i];
      PointEquations& own = equations_[i];
      own.v.setZero();
      own.g.setZero();
      for (std::size_t j = 0; j < point.observations.size(); ++j) {
        const SchurProblem::Observation& o = point.observations[j];
        const SchurCamera& camera = cameras[o.camera];
        const Vec3 turned = camera.rotation * point.position;
        const Vec3 p = turned + camera.translation;
        const double inverse_z = 1.0 / p.z(), x = p.x() * inverse_z, y = p.y() * inverse_z;
        const Vec2 r = problem_.focal_px * (Vec2(x, y) - o.ray);
        const double weight = huber(r.squaredNorm(), problem_.huber_px).weight;
        Mat23 by_p;
        by_p << 1.0, 0.0, -x, 0.0, 1.0, -y;
        by_p *= problem_.focal_px * inverse_z;
        const Mat23 b = by_p * camera.rotation;
        const Mat23 weighted_b = weight * b;
        own.v.noalias() += b.transpose() * weighted_b;
        own.g.noalias() += weighted_b.transpose() * r;
        const int slot = slot_of_[o.camera];
        if (slot < 0) continue;
        Mat26 a;
        for (int row = 0; row < 2; ++row)
          a.row(row) << turned.cross(Vec3(by_p.row(row))).transpose(), by_p.row(row);
        w_[own.first + j].noalias() = a.transpose() * weighted_b;
        sums.u[slot].noalias() += a.transpose() * (weight * a);
        sums.g[slot].noalias() += a.transpose() * (weight * r);
      }
    }
  });
  for (int c = 0; c < pattern_.free(); ++c) {
    u_[c].setZero();
    g_[c].setZero();
    for (const CameraSums& sums : sums_) {
      u_[c] += sums.u[c];
      g_[c] += sums.g[c];
    }
  }
}

// False when a point's equations do not determine it.
bool Solver::eliminate(double radius) {
  std::vector<char> failed(parts_.count, 0);
  parts_.each([&](std::size_t part) {
    CameraSums& sums = sums_[part];
    sums.clear_eliminated();
    for (std::size_t i = parts_.begin(part); i < parts_.begin(part + 1); ++i) {
      PointEquations& own = equations_[i];
      Mat3 v = own.v;
      v.diagonal() += damping(own.v) / radius;
      own.inverse = v.inverse();
      if (!own.inverse.allFinite()) {
        failed[part] = 1;
        return;
      }
      const auto& observations = problem_.points[i].observations;
      for (std::size_t j = 0; j < observations.size(); ++j) {
        const int a = slot_of_[observations[j].camera];
        if (a < 0) continue;
        const Mat63 y = w_[own.first + j] * own.inverse;
        sums.shift[a].noalias() += y * own.g;
        for (std::size_t k = j; k < observations.size(); ++k) {
          const int b = slot_of_[observations[k].camera];
          if (b < 0) continue;
          sums.outer[pattern_.place(a, b)].noalias() += y * w_[own.first + k].transpose();
        }
      }
    }
  });
  return std::ranges::count(failed, 1) == 0;
}

bool Solver::solve_cameras(double radius, Eigen::VectorXd& step) {
  const int free = pattern_.free();
  step = Eigen::VectorXd::Zero(6L * free);
  if (free == 0) return true;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * pattern_.blocks().size());
  for (std::size_t k = 0; k < pattern_.blocks().size(); ++k) {
    const auto& [a, b] = pattern_.blocks()[k];
    Mat6 block = Mat6::Zero();
    for (const CameraSums& sums : sums_) block -= sums.outer[k];
    if (a == b) {
      block += u_[a];
      block.diagonal() += damping(u_[a]) / radius;
    }
    for (int column = 0; column < 6; ++column)
      for (int row = 0; row < (a == b ? column + 1 : 6); ++row)
        entries.emplace_back(6 * a + row, 6 * b + column, block(row, column));
  }
  Eigen::SparseMatrix<double> schur(6L * free, 6L * free);
  schur.setFromTriplets(entries.begin(), entries.end());
  if (!analysed_) factor_.analyzePattern(schur);
  analysed_ = true;
  factor_.factorize(schur);
  if (factor_.info() != Eigen::Success) return false;
  Eigen::VectorXd right(6L * free);
  for (int c = 0; c < free; ++c) {
    Vec6 sum = -g_[c];
    for (const CameraSums& sums : sums_) sum += sums.shift[c];
    right.segment<6>(6L * c) = sum;
  }
  step = factor_.solve(right);
  return step.allFinite();
}

void Solver::solve_points(const Eigen::VectorXd& camera_step, std::vector<Vec3>& step) const {
  step.resize(problem_.points.size());
  parts_.each([&](std::size_t part) {
    for (std::size_t i = parts_.begin(part); i < parts_.begin(part + 1); ++i) {
      const PointEquations& own = equations_[i];
      const auto& observations = problem_.points[i].observations;
      Vec3 right = own.g;
      for (std::size_t j = 0; j < observations.size(); ++j) {
        const int slot = slot_of_[observations[j].camera];
        if (slot >= 0)
          right.noalias() += w_[own.first + j].transpose() * camera_step.segment<6>(6L * slot);
      }
      step[i] = -(own.inverse * right);
    }
  });
}

// The decrease of the cost under the quadratic model, for a step d that solves (H + D) d = -g:
//   -g.d - d.H d / 2 = (d.D d - g.d) / 2.
double Solver::promised(const Eigen::VectorXd& camera_step, const std::vector<Vec3>& point_step,
                        double radius) const {
  double sum = 0.0;
  for (int c = 0; c < pattern_.free(); ++c) {
    const Vec6 d = camera_step.segment<6>(6L * c);
    sum += d.dot(damping(u_[c]).cwiseProduct(d)) / radius - g_[c].dot(d);
  }
  for (std::size_t i = 0; i < point_step.size(); ++i) {
    const Vec3& d = point_step[i];
    sum += d.dot(damping(equations_[i].v).cwiseProduct(d)) / radius - equations_[i].g.dot(d);
  }
  return 0.5 * sum;
}

bool Solver::nothing_moves(const Eigen::VectorXd& camera_step,
                           const std::vector<Vec3>& point_step) const {
  double moved = camera_step.squaredNorm(), size = 0.0;
  for (const int c : camera_of_) size += 1.0 + problem_.cam_from_world[c].translation.squaredNorm();
  for (std::size_t i = 0; i < point_step.size(); ++i) {
    moved += point_step[i].squaredNorm();
    size += problem_.points[i].position.squaredNorm();
  }
  return std::sqrt(moved) <= kParameterTolerance * std::sqrt(size);
}

SchurReport Solver::run(const SchurOptions& options) {
  SchurReport report;
  std::vector<SchurCamera> cameras = cameras_of(problem_.cam_from_world);
  std::vector<Vec3> positions;
  for (const SchurProblem::Point& point : problem_.points) positions.push_back(point.position);
  double cost = cost_of(problem_, cameras, positions, parts_);
  report.initial_cost = report.final_cost = cost;
  if (!std::isfinite(cost)) return report;
  double radius = options.radius, shrink = 2.0;
  int refused = 0;
  bool moved = true;
  Eigen::VectorXd camera_step;
  std::vector<Vec3> point_step;
  while (report.iterations < options.max_iterations && radius > kSmallestRadius) {
    ++report.iterations;
    if (moved) linearise(cameras);
    moved = false;
    const auto refuse = [&] {
      radius /= shrink;
      shrink *= 2.0;
    };
    if (!eliminate(radius) || !solve_cameras(radius, camera_step)) {
      if (++refused >= kMaxRefusals) break;
      refuse();
      continue;
    }
    solve_points(camera_step, point_step);
    if (nothing_moves(camera_step, point_step)) {
      report.converged = true;
      break;
    }
    std::vector<Rigid3> poses = problem_.cam_from_world;
    for (std::size_t s = 0; s < camera_of_.size(); ++s) {
      const Vec3 turn = camera_step.segment<3>(6L * static_cast<Eigen::Index>(s));
      const double angle = turn.norm();
      Rigid3& pose = poses[camera_of_[s]];
      if (angle > 0.0)
        pose.rotation = (Quat(Eigen::AngleAxisd(angle, turn / angle)) * pose.rotation).normalized();
      pose.translation += camera_step.segment<3>(6L * static_cast<Eigen::Index>(s) + 3);
    }
    std::vector<Vec3> next = positions;
    for (std::size_t i = 0; i < next.size(); ++i) next[i] += point_step[i];
    const std::vector<SchurCamera> next_cameras = cameras_of(poses);
    const double next_cost = cost_of(problem_, next_cameras, next, parts_);
    if (!std::isfinite(next_cost)) {
      if (++refused >= kMaxRefusals) break;
      refuse();
      continue;
    }
    refused = 0;
    const double gained = cost - next_cost;
    const double quality = gained / promised(camera_step, point_step, radius);
    const bool settled = std::abs(gained) <= options.function_tolerance * cost;
    if (gained > 0.0 && (settled || quality > kMinQuality)) {
      problem_.cam_from_world = std::move(poses);
      for (std::size_t i = 0; i < next.size(); ++i) problem_.points[i].position = next[i];
      positions = std::move(next);
      cameras = next_cameras;
      cost = next_cost;
      moved = true;
      // Madsen, Nielsen and Tingleff, Methods for non-linear least squares problems, 2004, (2.20).
      radius = std::min(kLargestRadius,
                        radius / std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * quality - 1.0, 3)));
      shrink = 2.0;
    } else {
      refuse();
    }
    if (settled) {
      report.converged = true;
      break;
    }
  }
  report.final_cost = cost;
  report.radius = radius;
  return report;
}

}  // namespace

SchurReport minimise(SchurProblem& problem, const SchurOptions& options) {
  return Solver(problem).run(options);
}

}  // namespace rugae
