// Bad input, each with its exact message; tracks given by the user.

#include <gtest/gtest.h>

#include <filesystem>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "tests/trajectories/cavities.h"
#include "trajectories/free_space.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;

template <typename Work>
std::string error_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

class TrajectoryFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() /
        ("rugae_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) {
    write_atomic(folder_ / name, text);
    return (folder_ / name).string();
  }
  std::string load_error(const std::string& text) {
    const std::string file = write("mine.yaml", text);
    const std::string message = error_of([&] { load_trajectory(file); });
    EXPECT_TRUE(message.starts_with(file)) << message;
    return message.substr(std::min(file.size(), message.size()));
  }
  fs::path folder_;
};

TEST_F(TrajectoryFile, WrongContents) {
  EXPECT_EQ(load_error("length_cm: 120\npasess: 3\n"),
            ":2:1: unknown key 'pasess'; did you mean 'passes'?");
  EXPECT_EQ(load_error("loops: {cuont: 3}\n"), ":1:9: unknown key 'cuont'; did you mean 'count'?");
  EXPECT_EQ(load_error("loops: {shape: eigth}\n"),
            ":1:16: shape is 'eigth', expected one of: circle, eight, knot; did you mean "
            "'eight'?");
  EXPECT_EQ(load_error("length_cm: long\n"), ":1:12: length_cm is 'long', expected a number");
  EXPECT_EQ(load_error("length_cm: -3\n"), ":1:12: length_cm is -3, expected 1 to 10000");
  EXPECT_EQ(
      load_error("pace: {peak_speed: 9, bursts: 3, burst_share: 0.2}\n"),
      ":1:20: pace.peak_speed times pace.burst_share is 1.8, expected less than 1 (the mean speed "
      "is 1)");
  EXPECT_EQ(load_error("like: mine.yaml\n"), ":1:7: like goes in a circle");
  EXPECT_EQ(load_error("like: seven\n"),
            ":1:7: like: trajectory 'seven': no such preset; known: 1, 2, 3, 4, 5, 6, chessboard, "
            "inspection");
}

TEST_F(TrajectoryFile, LikeTakesWhatIsNotGiven) {
  write("base.yaml", "length_cm: 77\nloops: {count: 6, shape: knot}\n");
  const auto options = load_trajectory(write("mine.yaml", "like: base.yaml\nloops: {count: 9}\n"));
  EXPECT_EQ(options.name, "mine");
  EXPECT_EQ(options.length_cm, 77.0);
  EXPECT_EQ(options.loops.count, 9);
  EXPECT_EQ(options.loops.shape, LoopShape::knot);
}

TEST(TrajectoryPreset, UnknownName) {
  EXPECT_EQ(error_of([] { load_trajectory("seven"); }),
            "trajectory 'seven': no such preset; known: 1, 2, 3, 4, 5, 6, chessboard, inspection");
}

TEST(TrajectoryPreset, LengthsNoiseAndOilOfTheSix) {
  for (const std::string name : {"1", "2", "3", "4", "5", "6"}) {
    const TrajectoryOptions options = load_trajectory(name);
    EXPECT_EQ(std::to_string(options.paper_number), name);
    EXPECT_EQ(options.name, name);
    EXPECT_EQ(options.read_noise_factor > 1.0, name == "5");
    EXPECT_EQ(options.oil > 0.0, name == "6");
  }
}

// The demo's short path is trajectory 1 but for its length, and none of the paper's.
TEST(TrajectoryPreset, InspectionIsNotOfThePaper) {
  const TrajectoryOptions inspection = load_trajectory("inspection"), one = load_trajectory("1");
  EXPECT_EQ(inspection.paper_number, 0);
  EXPECT_EQ(inspection.clearance_mm, one.clearance_mm);
  EXPECT_LT(inspection.length_cm, one.length_cm);
}

TEST(PlanError, NoPlaceHasTheClearance) {
  TrajectoryOptions options = load_trajectory("4");
  options.clearance_mm = 60.0;
  const TriangleMesh wall = test_tube();
  const FreeSpace space(wall);
  const Vec3 place = space.widest_point();
  EXPECT_NEAR(space.widest_mm(), 32.0, 2.5);  // the tube's radius, to half a step of the grid
  EXPECT_EQ(error_of([&] { plan_path(wall, options, 1); }),
            fmt::format("trajectory '4' would leave the stomach: it asks for a clearance of 60 mm, "
                        "but the roomiest place, near ({:.1f}, {:.1f}, {:.1f}) mm, is {:.1f} mm "
                        "from the wall",
                        place.x(), place.y(), place.z(), space.depth_mm(place)));
}

TEST(PlanError, TheLengthDoesNotFit) {
  TrajectoryOptions options = load_trajectory("2");
  options.length_cm = 9000.0;
  const std::string message = error_of([&] { plan_path(test_tube(), options, 1); });
  EXPECT_TRUE(
      message.starts_with("trajectory '2' would leave the stomach: 9000 cm do not fit with "
                          "a clearance of 6 mm; the longest way found is "))
      << message;
}

TEST(PlanError, WallsWithoutAnInside) {
  const TrajectoryOptions options = load_trajectory("1");
  TriangleMesh flipped = test_ellipsoid();
  for (Vec3i& t : flipped.triangles) std::swap(t[0], t[1]);
  const double volume = signed_volume_mm3(test_ellipsoid());
  EXPECT_EQ(error_of([&] { plan_path(flipped, options, 1); }),
            fmt::format("trajectory '1': the wall encloses a volume of -{:.0f} mm^3; expected a "
                        "closed mesh whose normals point outward",
                        volume));
  TriangleMesh open = test_ellipsoid();
  open.triangles.pop_back();
  EXPECT_EQ(
      error_of([&] { plan_path(open, options, 1); }),
      "trajectory '1': the wall has 3 open edges, expected a closed mesh: nothing else has an "
      "inside");
}

TEST(SampleError, FramesAndRate) {
  TrajectoryOptions options;
  options.name = "short";
  options.length_cm = 5.0;
  const PlannedPath path = plan_path(test_ellipsoid(), options, 1);
  EXPECT_EQ(error_of([&] { sample_path(path, 1, 30.0); }),
            "a path is sampled at 1 frames, expected at least 2");
  EXPECT_EQ(error_of([&] { sample_path(path, 10, 0.0); }),
            "a path is sampled at 0 frames a second, expected more than 0");

  // The whole path whatever the number of frames, in equal steps of time.
  const PoseTrack few = sample_path(path, 3, 10.0), many = sample_path(path, 301, 10.0);
  EXPECT_EQ(few.front().world_from_camera.translation, many.front().world_from_camera.translation);
  EXPECT_EQ(few.back().world_from_camera.translation, many.back().world_from_camera.translation);
  EXPECT_EQ(few[1].world_from_camera.translation, many[150].world_from_camera.translation);
  EXPECT_EQ(few.back().world_from_camera.rotation.coeffs(),
            many.back().world_from_camera.rotation.coeffs());
  for (int i = 0; i < 301; ++i) EXPECT_EQ(many[i].time_s, i / 10.0);
}

// A 10 mm arc inside the ellipsoid, as a user may have recorded it, at uneven times.
PoseTrack recorded() {
  PoseTrack track;
  for (int i = 0; i <= 20; ++i) {
    const double a = 0.1 * i;
    track.push_back({0.1 * i + 0.03 * std::sin(0.9 * i),
                     Rigid3(Quat(Eigen::AngleAxisd(a, Vec3::UnitY())),
                            Vec3(10.0 + 20.0 * std::sin(a), -20.0, 30.0 + 20.0 * std::cos(a)))});
  }
  return track;
}

TEST_F(TrajectoryFile, FollowsATrack) {
  write("track.txt", tum_text(recorded()));
  const auto options = load_trajectory(write("mine.yaml", "file: track.txt\n"));
  const PlannedPath path = plan_path(test_ellipsoid(), options, 1);
  const PoseTrack track = recorded();
  for (const TimedPose& pose : track) {
    const Rigid3 found = path.world_from_camera(pose.time_s / track.back().time_s);
    EXPECT_LE((found.translation - pose.world_from_camera.translation).norm(), 1e-9);
    EXPECT_LE((found.rotation.conjugate() * pose.world_from_camera.rotation).vec().norm(), 1e-9);
  }
  EXPECT_NEAR(path.length_mm(), 20.0 * 2.0, 1e-2);  // an arc of 2 rad; ends without curvature
}

TEST_F(TrajectoryFile, ATrackThatLeavesIsRefused) {
  PoseTrack track = recorded();
  for (TimedPose& pose : track) pose.world_from_camera.translation.z() += 30.0;
  write("track.txt", tum_text(track));
  const auto options = load_trajectory(write("mine.yaml", "file: track.txt\n"));
  const std::string message = error_of([&] { plan_path(test_ellipsoid(), options, 1); });
  // The arc's top, z = 80, stands above the ellipsoid's, z = 75.
  EXPECT_TRUE(message.starts_with("trajectory 'mine' would leave the stomach: ")) << message;
  EXPECT_NE(message.find(" mm along its way, near (1"), std::string::npos) << message;
  EXPECT_NE(message.find(", -20.0, 80.0) mm, its distance to the wall is -"), std::string::npos)
      << message;
  EXPECT_TRUE(message.ends_with(" mm (outside), expected at least 6 mm")) << message;
}

TEST(CheckInside, NamesTheFirstPose) {
  const TriangleMesh wall = ellipsoid({40.0, 40.0, 40.0});
  const auto at = [](double x) { return TimedPose{x, {Quat::Identity(), Vec3(x, 0.0, 0.0)}}; };
  EXPECT_NO_THROW(check_inside(wall, {at(0.0), at(10.0), at(30.0)}, 6.0, "track.txt"));
  // On a sphere's pole the triangles meet at the radius itself: nearer than 6 mm beyond x = 34.
  const std::string near = error_of([&] {
    check_inside(wall, {at(0.0), at(38.0)}, 6.0, "track.txt");
  });
  EXPECT_TRUE(near.starts_with("track.txt: after pose 0, at (3")) << near;
  EXPECT_TRUE(near.ends_with(" mm from the wall, expected at least 6 mm inside")) << near;
  EXPECT_NE(near.find(", the camera is only 5."), std::string::npos) << near;
  const std::string outside = error_of([&] { check_inside(wall, {at(50.0)}, 6.0, "track.txt"); });
  EXPECT_EQ(
      outside,
      "track.txt: at pose 0, at (50.0, 0.0, 0.0) mm, the camera is outside, 10.00 mm from the "
      "wall, expected at least 6 mm inside");
  TimedPose lost = at(1.0);
  lost.world_from_camera.translation.y() = std::nan("");
  EXPECT_EQ(error_of([&] {
              check_inside(wall, {at(0.0), lost}, 6.0, "track.txt");
            }),
            "track.txt: pose 1 is not finite");
}

}  // namespace
}  // namespace rugae
