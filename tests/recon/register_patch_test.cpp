// A flat wall at a known distance: where its patches are in a second picture is known exactly.

#include "recon/dense/register_patch.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/files.h"
#include "core/random.h"
#include "dataset/image_io.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

class RegisterPatch : public ::testing::TestWithParam<int> {
 protected:
  static constexpr double kFocal = 0.8;  // of the width
  int width() const { return GetParam(); }
  int height() const { return width() * 3 / 4; }
  int shift_px() const { return width() / 32; }
  virtual double contrast() const { return 1.0; }      // of the texture, 38 levels
  virtual double noise_levels() const { return 0.0; }  // standard deviation, of 255
  Lens lens() const {
    Lens lens;
    lens.width = width();
    lens.height = height();
    lens.fx = lens.fy = kFocal * width();
    lens.cx = 0.5 * width();
    lens.cy = 0.5 * height();
    return lens;
  }

  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("rugae_register_" + std::to_string(getpid()) + "_" + std::to_string(width()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const cv::Mat wall =
        testing::draw(width() + shift_px(), height(), testing::Texture(4, width() / 60.0, 60.0));
    for (int i = 0; i < 2; ++i) {
      cv::Mat bgr, seen = wall(cv::Rect(i * shift_px(), 0, width(), height())).clone();
      for (int y = 0; y < seen.rows; ++y)
        for (int x = 0; x < seen.cols; ++x)
          seen.at<float>(y, x) = static_cast<float>(
              0.5 + contrast() * (seen.at<float>(y, x) - 0.5) +
              noise_levels() / 255.0 * random_normal(1, Purpose::test, i, y * seen.cols + x)[0]);
      cv::cvtColor(testing::to_8bit(seen), bgr, cv::COLOR_GRAY2BGR);
      write_image(folder_ / (std::to_string(i) + ".png"), bgr);
    }
    write_atomic(folder_ / "lens.yaml", lens_yaml(lens(), "test"));

    // The wall is one unit away, parallel to both pictures.
    structure_.frames = {0, 1};
    structure_.placed = {true, true};
    structure_.cam_from_world = {Rigid3{},
                                 Rigid3(Quat::Identity(), Vec3(-shift_px() / lens().fx, 0.0, 0.0))};
    const int step_px = width() / 20;
    for (int y = 2 * step_px; y < height() - 2 * step_px; y += step_px)
      for (int x = 3 * step_px; x < width() - 3 * step_px; x += step_px) {
        Track track;
        const Vec2 pixel(x + 0.3, y + 0.6);
        track.point =
            Vec3((pixel.x() - lens().cx) / lens().fx, (pixel.y() - lens().cy) / lens().fy, 1.0);
        track.triangulated = true;
        track.observations = {{0, pixel, track.point.head<2>()}};
        structure_.tracks.push_back(track);
      }
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
  Structure structure_;
};

INSTANTIATE_TEST_SUITE_P(Widths, RegisterPatch, ::testing::Values(320, 640, 1280));

// Of a pixel of 640: interpolation and 8-bit rounding; a wrong place is off by whole pixels.
constexpr double kPlacePx = 0.1;

TEST_P(RegisterPatch, FindsThePlaceFromAWrongGuess) {
  PreprocessOptions options;
  options.devignette = false;
  const FrameSource frames(Observations::open(folder_, folder_ / "lens.yaml"), options);
  const auto patches = make_patches(frames, structure_);
  ASSERT_GE(patches.size(), structure_.tracks.size() * 3 / 4);
  const PatchImage image = prepare_patch_image(frames.pose_frame(1));
  const PatchRegistrar registrar(lens());
  // The camera is thought to stand aside by a hundredth of the width.
  Rigid3 guess = structure_.cam_from_world[1];
  guess.translation += Vec3(0.01, -0.008, 0.0) / kFocal;
  int found = 0;
  for (const WallPatch& patch : patches) {
    const auto sight = foretell(patch, {guess, {}}, frames.shutter());
    if (!sight) continue;
    EXPECT_LT((sight->linear - Mat2::Identity()).norm(), 1e-6);
    const auto pixel = registrar.find(patch, *sight, image, 0.0375 * width());
    if (!pixel) continue;
    const Vec2 truth = patch.anchor_px - Vec2(shift_px(), 0.0);
    EXPECT_LT((*pixel - truth).norm(), kPlacePx * width() / 640.0);
    ++found;
  }
  EXPECT_GE(found, static_cast<int>(patches.size()) * 3 / 4) << patches.size();
}

// As the smallest of the cameras sees a far wall: 250 px wide, texture of 8 levels, noise of 4.
class RegisterNoisyPatch : public RegisterPatch {
 protected:
  double contrast() const override { return 0.2; }
  double noise_levels() const override { return 4.0; }
};
INSTANTIATE_TEST_SUITE_P(Narrow, RegisterNoisyPatch, ::testing::Values(250));

TEST_P(RegisterNoisyPatch, SettlesThreeInFour) {
  PreprocessOptions options;
  options.devignette = false;
  const FrameSource frames(Observations::open(folder_, folder_ / "lens.yaml"), options);
  const auto patches = make_patches(frames, structure_);
  ASSERT_GE(patches.size(), structure_.tracks.size() * 3 / 4);
  const PatchImage image = prepare_patch_image(frames.pose_frame(1));
  const PatchRegistrar registrar(lens());
  int settled = 0;
  double square = 0.0;
  for (const WallPatch& patch : patches) {
    const auto sight = foretell(patch, {structure_.cam_from_world[1], {}}, frames.shutter());
    if (!sight) continue;
    const auto pixel = registrar.settle(patch, *sight, image, sight->pixel + Vec2(0.4, -0.3));
    if (!pixel) continue;
    square += (*pixel - (patch.anchor_px - Vec2(shift_px(), 0.0))).squaredNorm();
    ++settled;
  }
  EXPECT_GE(settled, static_cast<int>(patches.size()) * 3 / 4) << patches.size();
  EXPECT_LE(std::sqrt(square / settled), 0.5);  // px: the guess is that far off
}

}  // namespace
}  // namespace rugae
