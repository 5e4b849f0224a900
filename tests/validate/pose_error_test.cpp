#include "validate/pose_error.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "core/check.h"
#include "core/random.h"
#include "core/units.h"

namespace rugae {
namespace {

constexpr double kRounding_mm = 1e-9;   // doubles at 1e2 mm keep 1e-14; sums of 1e2 terms
constexpr double kRounding_rad = 1e-7;  // angles near zero come from acos of 1 - angle^2 / 2

// A path that fills space, one pose every 0.1 s.
PoseTrack curl(int poses) {
  PoseTrack track;
  for (int i = 0; i < poses; ++i) {
    const double s = 0.1 * i;
    const Quat q = Eigen::AngleAxisd(0.3 * s, Vec3(1, 2, 3).normalized()) * Quat::Identity();
    track.push_back({0.1 * i, Rigid3(q, Vec3(30 * std::cos(s), 20 * std::sin(s), 5 * s))});
  }
  return track;
}

PoseTrack moved(const PoseTrack& track, const Sim3& sim) {
  PoseTrack out = track;
  for (TimedPose& pose : out) pose.world_from_camera = sim * pose.world_from_camera;
  return out;
}

// Straight along x at one mm a frame, ten frames a second, with a bend in y so that alignment is
// determined.
PoseTrack straight(int poses) {
  PoseTrack track;
  for (int i = 0; i < poses; ++i)
    track.push_back({0.1 * i, Rigid3(Quat::Identity(), Vec3(i, 0, 0))});
  return track;
}

std::vector<std::optional<Rigid3>> all_poses(const PoseTrack& track) {
  std::vector<std::optional<Rigid3>> poses;
  for (const TimedPose& pose : track) poses.push_back(pose.world_from_camera);
  return poses;
}

std::vector<Rigid3> poses_of(const PoseTrack& track) {
  std::vector<Rigid3> poses;
  for (const TimedPose& pose : track) poses.push_back(pose.world_from_camera);
  return poses;
}

TEST(PoseError, AMovedTurnedAndScaledPathHasNoError) {
  const PoseTrack truth = curl(80);
  const Sim3 sim{0.02, Quat(Eigen::AngleAxisd(1.1, Vec3(3, -1, 2).normalized())), Vec3(7, -40, 3)};
  const PoseErrors errors = pose_errors(truth, moved(truth, sim));
  ASSERT_TRUE(errors.sim3);
  EXPECT_TRUE(errors.sim3->position_mm.rmse <= kRounding_mm);
  EXPECT_TRUE(errors.sim3->rotation_rad.max <= kRounding_rad);
  EXPECT_NEAR(errors.sim3->truth_from_estimate.scale, 50.0, 1e-9);
  EXPECT_TRUE(errors.per_frame.translation_mm.max <= kRounding_mm);
  EXPECT_TRUE(errors.per_second.rotation_rad.max <= kRounding_rad);
  EXPECT_EQ(errors.tracked, 80);
  EXPECT_EQ(errors.tracked_share, 1.0);
  EXPECT_EQ(errors.note, "");
  // Without scale the path stays fifty times too small: it cannot fit.
  ASSERT_TRUE(errors.se3);
  EXPECT_TRUE(errors.se3->position_mm.rmse > 10.0);
  EXPECT_EQ(errors.se3->truth_from_estimate.scale, 1.0);
}

// Displacements that no rigid motion or scale can take up: an alternating offset orthogonal to all
// of them. On points with zero mean, no motion reduces sum |e_i|^2 when sum e_i = 0,
// sum x_i x e_i = 0 and sum x_i . e_i = 0.
TEST(PoseError, AnOffsetThatNoMotionTakesUpGivesItsOwnRmse) {
  // A square of side 20; e = (+z, -z, +z, -z) at its corners meets all three conditions.
  const std::vector<Vec3> corners{{10, 10, 0}, {-10, 10, 0}, {-10, -10, 0}, {10, -10, 0}};
  TrackPair pair;
  for (int i = 0; i < 4; ++i) {
    pair.time_s.push_back(i);
    pair.truth.emplace_back(Quat::Identity(), corners[i]);
    pair.estimate.emplace_back(Quat::Identity(), corners[i] + Vec3(0, 0, i % 2 == 0 ? 0.5 : -0.5));
  }
  const auto error = absolute_error(pair, Alignment::se3);
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->position_mm.rmse, 0.5, kRounding_mm);
  EXPECT_NEAR(error->position_mm.mean, 0.5, kRounding_mm);
  EXPECT_NEAR(error->position_mm.median, 0.5, kRounding_mm);
  EXPECT_NEAR(error->position_mm.max, 0.5, kRounding_mm);
}

TEST(PoseError, ScaleErrorOfAnEstimateTenPercentTooLongIsTenPercent) {
  const PoseTrack truth = curl(50);
  const PoseErrors errors =
      pose_errors(truth, moved(truth, Sim3{1.1, Quat::Identity(), Vec3::Zero()}));
  ASSERT_TRUE(errors.sim3);
  EXPECT_NEAR(1.0 / errors.sim3->truth_from_estimate.scale - 1.0, 0.1, 1e-12);
}

TEST(PoseError, AConstantTurnOfEveryCameraIsTheRotationError) {
  const PoseTrack truth = curl(50);
  PoseTrack estimate = truth;
  const Quat turn(Eigen::AngleAxisd(0.25, Vec3(0, 1, 0)));
  for (TimedPose& pose : estimate)
    pose.world_from_camera.rotation = pose.world_from_camera.rotation * turn;
  const PoseErrors errors = pose_errors(truth, estimate);
  ASSERT_TRUE(errors.sim3);
  EXPECT_TRUE(errors.sim3->position_mm.rmse <= kRounding_mm);
  EXPECT_NEAR(errors.sim3->rotation_rad.rmse, 0.25, kRounding_rad);
  EXPECT_NEAR(errors.sim3->rotation_rad.max, 0.25, kRounding_rad);
}

TEST(PoseError, DriftGivesExactRelativeErrors) {
  const PoseTrack truth = straight(41);
  PoseTrack estimate = truth;  // 0.02 mm sideways a frame: 0.2 a second, 0.2 every 10 mm
  for (int i = 0; i < 41; ++i) estimate[i].world_from_camera.translation.y() = 0.02 * i;
  const auto error = [&](const std::vector<int>& steps) {
    return relative_error(poses_of(truth), all_poses(estimate), 1.0, steps);
  };
  const RelativeError frame = error(steps_of_frames(41, 1));
  EXPECT_EQ(frame.translation_mm.count, 40u);
  EXPECT_NEAR(frame.translation_mm.rmse, 0.02, kRounding_mm);
  const RelativeError second = error(steps_of_time(truth, 1.0));
  EXPECT_EQ(second.translation_mm.count, 31u);
  EXPECT_NEAR(second.translation_mm.rmse, 0.2, kRounding_mm);
  const RelativeError path = error(steps_of_path(truth, 10.0));
  EXPECT_EQ(path.translation_mm.count, 31u);
  EXPECT_NEAR(path.translation_mm.median, 0.2, kRounding_mm);
}

TEST(PoseError, TurningDriftGivesTheExactAngle) {
  const PoseTrack truth = straight(11);
  PoseTrack estimate = truth;
  for (int i = 0; i < 11; ++i)
    estimate[i].world_from_camera.rotation = Quat(Eigen::AngleAxisd(0.01 * i, Vec3::UnitZ()));
  const RelativeError error =
      relative_error(poses_of(truth), all_poses(estimate), 1.0, steps_of_frames(11, 1));
  EXPECT_NEAR(error.rotation_rad.rmse, 0.01, kRounding_rad);
}

// One step that moves and turns: |Q^-1 P| has the translation |t_p - t_q| whatever the rotations,
// which P Q^-1 has not; and no place or orientation of the first pose changes that.
TEST(PoseError, AStepThatTurnsAndMovesGivesBothErrorsExactly) {
  const auto turn_z = [](double rad) { return Quat(Eigen::AngleAxisd(rad, Vec3::UnitZ())); };
  const Rigid3 start{Quat(Eigen::AngleAxisd(1.0, Vec3(1, 1, 0).normalized())), Vec3(30, -20, 10)};
  const std::vector<Rigid3> truth{start, start * Rigid3(turn_z(0.3), Vec3(5, 0, 0))};
  const std::vector<std::optional<Rigid3>> estimate{start,
                                                    start * Rigid3(turn_z(0.5), Vec3(5, 0.2, 0))};
  const RelativeError error = relative_error(truth, estimate, 1.0, {1, -1});
  EXPECT_NEAR(error.translation_mm.rmse, 0.2, kRounding_mm);
  EXPECT_NEAR(error.rotation_rad.rmse, 0.2, kRounding_rad);
}

TEST(PoseError, ALostFrameIsCountedAndBreaksItsSteps) {
  const PoseTrack truth = curl(20);
  PoseTrack estimate = truth;
  estimate.erase(estimate.begin() + 7);
  const PoseErrors errors = pose_errors(truth, estimate);
  EXPECT_EQ(errors.frames, 20);
  EXPECT_EQ(errors.tracked, 19);
  EXPECT_NEAR(errors.tracked_share, 0.95, 1e-15);
  EXPECT_EQ(errors.per_frame.possible, 19u);
  EXPECT_EQ(errors.per_frame.translation_mm.count, 17u);  // steps 6-7 and 7-8 are gone
}

TEST(PoseError, TooFewFramesSaySo) {
  const PoseTrack truth = curl(20);
  const PoseErrors errors = pose_errors(truth, {truth[3], truth[9]});
  EXPECT_FALSE(errors.sim3);
  EXPECT_FALSE(errors.se3);
  EXPECT_EQ(errors.note, "2 of 20 frames tracked: an alignment needs 3");
  EXPECT_EQ(errors.tracked, 2);
  const PoseErrors none = pose_errors(truth, {});
  EXPECT_EQ(none.tracked_share, 0.0);
  EXPECT_EQ(none.note, "0 of 20 frames tracked: an alignment needs 3");
}

TEST(PoseError, AStraightPathSaysThatItDeterminesNoRotation) {
  const PoseTrack truth = straight(20);
  const PoseErrors errors = pose_errors(truth, truth);
  EXPECT_FALSE(errors.sim3);
  EXPECT_NE(errors.note.find("lie on one line"), std::string::npos);
}

TEST(PoseError, APoseThatIsNotFiniteIsAnError) {
  const PoseTrack truth = curl(10);
  PoseTrack estimate = truth;
  estimate[4].world_from_camera.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(pose_errors(truth, estimate), Error);
}

TEST(PoseError, StepsOfPathEndAtTheFirstPoseFarEnough) {
  PoseTrack track;
  for (const double x : {0.0, 4.0, 9.0, 12.0, 30.0})
    track.push_back({x, Rigid3(Quat::Identity(), Vec3(x, 0, 0))});
  EXPECT_EQ(steps_of_path(track, 10.0), (std::vector<int>{3, 4, 4, 4, -1}));
}

RC_GTEST_PROP(PoseError, MovingTheWorldChangesNoMetric, (std::uint32_t world)) {
  const PoseTrack truth = curl(40);
  PoseTrack estimate = truth;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto n = random_normal(5, Purpose::test, 0, i);
    estimate[i].world_from_camera.translation += 0.3 * Vec3(n[0], n[1], n[2]);
  }
  const auto u = random_uniform(world, Purpose::test, 1, 0);
  const Sim3 motion{1.0, Quat(Eigen::AngleAxisd(6.0 * u[0], Vec3(u[1], u[2], u[3]).normalized())),
                    100.0 * Vec3(u[3] - 0.5, u[1] - 0.5, u[2] - 0.5)};
  const PoseErrors here = pose_errors(truth, estimate);
  const PoseErrors both = pose_errors(moved(truth, motion), moved(estimate, motion));
  const PoseErrors only_truth = pose_errors(moved(truth, motion), estimate);
  RC_ASSERT(here.sim3->position_mm.rmse > 0.1);
  for (const PoseErrors& there : {both, only_truth}) {
    RC_ASSERT(std::abs(there.sim3->position_mm.rmse - here.sim3->position_mm.rmse) <= kRounding_mm);
    RC_ASSERT(std::abs(there.se3->position_mm.mean - here.se3->position_mm.mean) <= kRounding_mm);
    RC_ASSERT(std::abs(there.per_frame.translation_mm.rmse - here.per_frame.translation_mm.rmse) <=
              kRounding_mm);
  }
}

}  // namespace
}  // namespace rugae
