// How near to the truth the adjustment of noisy tracks can come at all, and how near it comes.

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "core/sim3.h"
#include "recon/structure.h"
#include "synthetic.h"

namespace rugae {
namespace {

constexpr double kNoisePx = 0.2;

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Displacements of the camera centres that a similarity of the world makes: seven columns.
Eigen::MatrixXd similarities(const std::vector<Vec3>& centres) {
  Eigen::MatrixXd moves(3 * centres.size(), 7);
  for (std::size_t k = 0; k < centres.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(3 * k);
    moves.block<3, 3>(row, 0) = Mat3::Identity();
    moves.block<3, 3>(row, 3) = -cross_matrix(centres[k]);
    moves.block<3, 1>(row, 6) = centres[k];
  }
  return moves;
}

// The least expected root mean square error of the camera centres after the best Sim(3), for white
// noise of kNoisePx in each coordinate (Cramer and Rao): from the Fisher information at the
// structure itself, its points eliminated. A pose moves by exp(w, t) from the left: its centre by
// -R^T t. In map units.
double least_path_error(const Structure& s, double focal_px) {
  const auto n = static_cast<Eigen::Index>(s.frames.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  using Mat63 = Eigen::Matrix<double, 6, 3>;
  for (const Track& track : s.tracks) {
    Mat3 v = Mat3::Zero();
    std::vector<std::pair<Eigen::Index, Mat63>> w;
    for (const auto& o : track.observations) {
      const Rigid3& pose = s.cam_from_world[o.keyframe];
      const Vec3 p = pose * track.point;
      Eigen::Matrix<double, 2, 3> by_p;
      by_p << 1, 0, -p.x() / p.z(), 0, 1, -p.y() / p.z();
      by_p *= focal_px / p.z() / kNoisePx;
      const Eigen::Matrix<double, 2, 3> by_point = by_p * pose.rotation.toRotationMatrix();
      Eigen::Matrix<double, 2, 6> by_pose;
      by_pose << -by_p * cross_matrix(p), by_p;
      information.block<6, 6>(6 * o.keyframe, 6 * o.keyframe) += by_pose.transpose() * by_pose;
      v += by_point.transpose() * by_point;
      w.emplace_back(6 * o.keyframe, by_pose.transpose() * by_point);
    }
    const Mat3 inverse = v.inverse();
    for (const auto& [i, wi] : w)
      for (const auto& [j, wj] : w) information.block<6, 6>(i, j) -= wi * inverse * wj.transpose();
  }
  // Seven directions have no information, those of a similarity; they are projected out below, so
  // whatever is added to them does not matter.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  Eigen::VectorXd inverse = eigen.eigenvalues();
  for (Eigen::Index i = 0; i < inverse.size(); ++i) inverse[i] = i < 7 ? 0.0 : 1.0 / inverse[i];
  const Eigen::MatrixXd covariance =
      eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  Eigen::MatrixXd centre_by_pose = Eigen::MatrixXd::Zero(3 * n, 6 * n);
  std::vector<Vec3> centres;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Rigid3& pose = s.cam_from_world[static_cast<std::size_t>(k)];
    centre_by_pose.block<3, 3>(3 * k, 6 * k + 3) = -pose.rotation.toRotationMatrix().transpose();
    centres.push_back(pose.inverse().translation);
  }
  const Eigen::MatrixXd moves = similarities(centres);
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(3 * n, 3 * n) -
                               moves * (moves.transpose() * moves).ldlt().solve(moves.transpose());
  const Eigen::MatrixXd of_centres =
      rest * centre_by_pose * covariance * centre_by_pose.transpose() * rest;
  return std::sqrt(of_centres.trace() / static_cast<double>(n));
}

class CramerRao : public testing::TestWithParam<std::uint64_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, CramerRao, testing::Values(1, 2, 3, 4, 5, 6));

// The error of one draw scatters around the bound; half as much again leaves room for that.
constexpr double kOverTheBound = 1.5;

TEST_P(CramerRao, NoisyTracksComeNearTheBound) {
  const synthetic::World world = synthetic::make_world({.noise_px = kNoisePx, .seed = GetParam()});
  Progress progress(Progress::Output::silent);
  const Structure s = build_structure(world.frames, world.tracks, world.lens, BundleOptions{},
                                      kFinalAdjustment, progress);
  ASSERT_EQ(s.placed_count(), static_cast<int>(world.frames.size()));
  std::vector<Vec3> ours, truth;
  for (std::size_t k = 0; k < world.frames.size(); ++k) {
    ours.push_back(s.cam_from_world[k].inverse().translation);
    truth.push_back(world.cam_from_world[k].inverse().translation);
  }
  const double mm_per_unit = umeyama(ours, truth, true)->scale;
  const double bound_mm = mm_per_unit * least_path_error(s, world.lens.fx);
  const double error_mm = synthetic::path_error(s, world).rmse;
  std::printf("path error %.2f um, at least %.2f um\n", 1000 * error_mm, 1000 * bound_mm);
  EXPECT_TRUE(error_mm <= kOverTheBound * bound_mm) << error_mm << " " << bound_mm;
  // Far below it something would be wrong with the bound.
  EXPECT_TRUE(error_mm >= bound_mm / 3.0) << error_mm << " " << bound_mm;
}

}  // namespace
}  // namespace rugae
