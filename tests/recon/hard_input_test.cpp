// What a capsule sends on a bad day: each sequence ends in a right path of the frames that could be
// placed, or in an error that says why, never in a crash or a wrong map that nobody is told of.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/random.h"
#include "dataset/image_io.h"
#include "recon/pipeline.h"
#include "synthetic.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 24;
constexpr double kStepRad = 0.035;  // about 0.8 mm and 2 degrees between frames
constexpr double kWhipRad = 0.32;   // 18 degrees
/// Of the path's extent: three times what clean pictures of this size give.
constexpr double kPathShare = 0.03;

struct Outcome {
  std::string error;
  int placed = 0;
  double share = 0.0;  // of the path's extent, the error over the placed frames
};

class HardInput : public testing::TestWithParam<std::string> {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::path(testing::TempDir()) / fmt::format("rugae_hard_input_{}", getpid());
    fs::remove_all(root_);
    std::vector<Rigid3> path;
    for (int i = 0; i < kFrames; ++i) path.push_back(synthetic::world_from_camera(i * kStepRad));
    recording_ = synthetic::record(root_ / "recording", lens(), path, 1.0);
    for (int i = 0; i < kFrames; ++i)
      pictures_.push_back(read_image_bgr(recording_.images / fmt::format("{:06}.png", i)));
  }
  static void TearDownTestSuite() {
    fs::remove_all(root_);
    pictures_.clear();
  }
  static Lens lens() { return synthetic::lens_of(320, 240); }

  /// Of pictures that the true path belongs to.
  Outcome run(const std::vector<cv::Mat>& pictures, const std::vector<Rigid3>& truth) const {
    const fs::path folder = root_ / "case";
    fs::remove_all(folder);
    make_folder(folder / "images");
    for (std::size_t i = 0; i < pictures.size(); ++i)
      write_image(folder / "images" / fmt::format("{:06}.png", i), pictures[i]);
    ReconOptions options;
    options.method = GetParam();
    options.keyframes.mean_flow_px = 15.0;
    options.pictures = false;
    Progress progress(Progress::Output::silent);
    Outcome outcome;
    try {
      const Estimate e = reconstruct(Observations::open(folder / "images", recording_.calibration),
                                     options, folder / "out", progress);
      std::vector<Rigid3> estimated, true_poses;
      for (std::size_t i = 0; i < pictures.size(); ++i) {
        if (e.states[i] == FrameState::lost) continue;
        ++outcome.placed;
        estimated.push_back(e.world_from_camera[i]);
        true_poses.push_back(truth[i]);
      }
      const auto error = synthetic::path_error(estimated, true_poses);
      outcome.share = error.rmse / error.path_extent;
    } catch (const Error& error) {
      outcome.error = error.what();
    }
    return outcome;
  }
  static void expect_right(const Outcome& outcome, int at_least) {
    EXPECT_EQ(outcome.error, "");
    EXPECT_GE(outcome.placed, at_least);
    EXPECT_TRUE(outcome.share <= kPathShare) << outcome.share;
  }

  static fs::path root_;
  static synthetic::Recording recording_;
  static std::vector<cv::Mat> pictures_;
};
fs::path HardInput::root_;
synthetic::Recording HardInput::recording_;
std::vector<cv::Mat> HardInput::pictures_;

INSTANTIATE_TEST_SUITE_P(Methods, HardInput, testing::Values("paper", "dense"),
                         [](const auto& method) { return method.param; });

// Turning shows no depth: the start has to wait for the camera to move.
TEST_P(HardInput, PureRotationAtTheStart) {
  std::vector<cv::Mat> pictures;
  std::vector<Rigid3> truth;
  constexpr int kTurns = 6;
  for (int i = kTurns; i > 0; --i) {
    truth.push_back(recording_.world_from_camera[0] *
                    Rigid3(Quat(Eigen::AngleAxisd(-0.05 * i, Vec3::UnitY())), Vec3::Zero()));
    pictures.push_back(synthetic::picture(lens(), truth.back(), 1.0, 6, i));
  }
  for (int i = 0; i < kFrames; ++i) {
    truth.push_back(recording_.world_from_camera[i]);
    pictures.push_back(pictures_[i]);
  }
  expect_right(run(pictures, truth), kFrames);
}

// The chain breaks; behind the gap the wall is known again.
TEST_P(HardInput, BlackFramesInTheMiddle) {
  std::vector<cv::Mat> pictures = pictures_;
  constexpr int kFirst = 14, kBlack = 3;
  const cv::Mat black(240, 320, CV_8UC3, cv::Scalar::all(0));
  for (int i = kFirst; i < kFirst + kBlack; ++i) pictures[i] = black;
  const Outcome outcome = run(pictures, recording_.world_from_camera);
  expect_right(outcome, kFrames - kBlack);
  EXPECT_LE(outcome.placed, kFrames - kBlack);
}

// Four frames in which the camera turns by a fifth of the picture each: of the flow a part
// alone is right at first.
TEST_P(HardInput, AWhipInTheMiddle) {
  std::vector<cv::Mat> pictures;
  std::vector<Rigid3> truth;
  double turned_rad = 0.0;
  for (int i = 0; i < kFrames; ++i) {
    truth.push_back(synthetic::world_from_camera(turned_rad));
    pictures.push_back(synthetic::picture(lens(), truth.back(), 1.0, 6, i));
    turned_rad += i >= 10 && i < 14 ? kWhipRad : kStepRad;
  }
  expect_right(run(pictures, truth), kFrames);
}

// White blots over half of every picture, standing still as the lamps do.
TEST_P(HardInput, HighlightsOverHalfThePicture) {
  std::vector<cv::Mat> pictures;
  cv::Mat blots(240, 320, CV_8U, cv::Scalar(0));
  for (int i = 0; 2 * cv::countNonZero(blots) < 320 * 240; ++i) {
    const auto u = random_uniform(3, Purpose::test, 0, i);
    cv::circle(blots, {static_cast<int>(320 * u[0]), static_cast<int>(240 * u[1])},
               4 + static_cast<int>(10 * u[2]), cv::Scalar(255), cv::FILLED);
  }
  for (const cv::Mat& picture : pictures_) {
    pictures.push_back(picture.clone());
    pictures.back().setTo(cv::Scalar::all(255), blots);
  }
  const Outcome outcome = run(pictures, recording_.world_from_camera);
  if (outcome.error.empty())
    expect_right(outcome, 2);
  else
    EXPECT_NE(outcome.error.find("usable frames"), std::string::npos) << outcome.error;
}

TEST_P(HardInput, AFrozenCameraIsAnError) {
  const std::vector<cv::Mat> pictures(8, pictures_[3]);
  const std::vector<Rigid3> truth(8, recording_.world_from_camera[3]);
  const Outcome outcome = run(pictures, truth);
  EXPECT_NE(outcome.error.find("usable frames"), std::string::npos)
      << outcome.error << " " << outcome.placed;
}

// Every second frame first, then the others backwards: what is placed stands right all the same.
TEST_P(HardInput, FramesOutOfOrder) {
  std::vector<cv::Mat> pictures;
  std::vector<Rigid3> truth;
  const auto take = [&](int i) {
    pictures.push_back(pictures_[i]);
    truth.push_back(recording_.world_from_camera[i]);
  };
  for (int i = 0; i < kFrames; i += 2) take(i);
  for (int i = kFrames - 1; i > 0; i -= 2) take(i);
  expect_right(run(pictures, truth), kFrames);
}

// The second half first: where the other one ends, it shows what the first began with.
TEST_P(HardInput, HalvesInTheWrongOrder) {
  std::vector<cv::Mat> pictures;
  std::vector<Rigid3> truth;
  for (int i = 0; i < kFrames; ++i) {
    const int from = (i + kFrames / 2) % kFrames;
    pictures.push_back(pictures_[from]);
    truth.push_back(recording_.world_from_camera[from]);
  }
  expect_right(run(pictures, truth), kFrames);
}

TEST_P(HardInput, OneFrameIsAnError) {
  const Outcome outcome = run({pictures_[0]}, {recording_.world_from_camera[0]});
  EXPECT_NE(outcome.error.find("at least two"), std::string::npos) << outcome.error;
}

}  // namespace
}  // namespace rugae
