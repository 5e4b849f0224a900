#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/files.h"
#include "core/pose_track.h"
#include "core/presets.h"
#include "core/random.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

class Files : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_ = fs::temp_directory_path() /
                     ("rugae_files_" +
                      std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST_F(Files, AtomicWriteLeavesNoTemporary) {
  write_atomic(folder_ / "a.txt", "one");
  write_atomic(folder_ / "a.txt", "two");
  EXPECT_EQ(read_text(folder_ / "a.txt"), "two");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(Files, FullDiskIsSaid) {
  fs::create_symlink("/dev/full", folder_ / "a.tmp.txt");  // the temporary neighbour of a.txt
  EXPECT_EQ(message_of([&] { write_atomic(folder_ / "a.txt", "text"); }),
            (folder_ / "a.txt").string() + ": cannot be written: No space left on device");
}

TEST_F(Files, FoldersThatCannotBe) {
  write_atomic(folder_ / "file", "x");
  EXPECT_EQ(
      message_of([&] { make_folder(folder_ / "file" / "out"); }),
      (folder_ / "file" / "out").string() + ": output folder cannot be created: Not a directory");
  EXPECT_EQ(message_of([] { read_text("/nowhere"); }), "/nowhere: no such file");
}

// FIPS 180-4 example: SHA-256 of "abc".
TEST_F(Files, Sha256KnownAnswer) {
  const std::string expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  EXPECT_EQ(sha256_of_bytes("abc"), expected);
  write_atomic(folder_ / "abc", "abc");
  EXPECT_EQ(sha256_of_file(folder_ / "abc"), expected);
}

PoseTrack some_track() {
  PoseTrack track;
  for (int i = 0; i < 10; ++i) {
    const auto n = random_normal(5, Purpose::test, 0, i);
    track.push_back(
        {i / 30.0, Rigid3(Quat(n[0], n[1], n[2], n[3]).normalized(), Vec3(n[0], n[1], n[2]))});
  }
  return track;
}

TEST_F(Files, TumKeepsEveryBit) {
  const PoseTrack track = some_track();
  write_atomic(folder_ / "t.txt", tum_text(track));
  const PoseTrack back = read_tum(folder_ / "t.txt");
  ASSERT_EQ(back.size(), track.size());
  for (std::size_t i = 0; i < track.size(); ++i) {
    EXPECT_EQ(back[i].time_s, track[i].time_s);
    EXPECT_EQ(back[i].world_from_camera.translation, track[i].world_from_camera.translation);
    EXPECT_TRUE(back[i].world_from_camera.rotation.coeffs().isApprox(
        track[i].world_from_camera.rotation.coeffs(), 1e-15));
  }
}

TEST_F(Files, TumErrorsNameTheLine) {
  const auto file = folder_ / "t.txt";
  const auto message = [&](const std::string& text) {
    write_atomic(file, text);
    return message_of([&] { read_tum(file); });
  };
  EXPECT_EQ(message("# x\n0 1 2 3 0 0 0\n"),
            file.string() + ":2: 7 values, expected 8 (time tx ty tz qx qy qz qw)");
  EXPECT_EQ(message("0 nan 2 3 0 0 0 1\n"), file.string() + ":1: 'nan' is not a finite number");
  EXPECT_EQ(message("0 1 2 3 0 0 0 2\n"), file.string() + ":1: quaternion of norm 2, expected 1");
  EXPECT_EQ(message("1 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n"),
            file.string() + ":2: time 1 does not ascend");
}

TEST(PoseTrack, InterpolatesBetweenAndRefusesOutside) {
  const PoseTrack track = {
      {0.0, Rigid3()}, {2.0, Rigid3(Quat(Eigen::AngleAxisd(1.0, Vec3::UnitZ())), Vec3(4, 0, 0))}};
  const auto middle = interpolate(track, 0.5);
  ASSERT_TRUE(middle);
  EXPECT_NEAR(middle->translation.x(), 1.0, 1e-15);
  EXPECT_NEAR(angle_between_rad(middle->rotation, Quat::Identity()), 0.25, 1e-12);
  EXPECT_TRUE(interpolate(track, 2.0));
  EXPECT_FALSE(interpolate(track, -1e-9));
  EXPECT_FALSE(interpolate(track, std::nan("")));
  EXPECT_NEAR(length_mm(track), 4.0, 1e-15);
}

TEST(Presets, MisspeltNameOffersTheNearest) {
  const std::string message = message_of([] { find_preset("cameras", "camera", "misumi-v550"); });
  EXPECT_EQ(message,
            "camera 'misumi-v550': no such preset; did you mean 'misumi-v5506'?; known: "
            "awaiba-naneye, misumi-v3506, "
            "misumi-v5506, potensic-mini");
}

}  // namespace
}  // namespace rugae
