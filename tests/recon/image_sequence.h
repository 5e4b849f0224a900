#pragma once
// Plain folders of frames in which a flat wall moves by known steps.

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "core/files.h"
#include "dataset/image_io.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"
#include "synthetic_texture.h"

namespace rugae::testing {

/// The rows from `row` on see another wall, nearer: its steps are so many times as long.
struct Near {
  int row = 1 << 20, times = 1;
};

class ImageSequence : public ::testing::Test {
 public:
  static constexpr int kWidth = 320, kHeight = 240;

 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("rugae_sequence_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The wall moves to the left by whole steps, px a frame; 600 px of it in all. From frame
  /// `other_wall_from` on another wall is seen.
  FrameSource source(const std::vector<double>& steps_px, const PreprocessOptions& options,
                     std::size_t other_wall_from = ~std::size_t{0}, const Near& near = {}) {
    const auto wall = [&](std::uint64_t seed) {
      return draw(kWidth + 600, kHeight, Texture(seed, 7.0, 60.0));
    };
    const cv::Mat first = wall(1), other = wall(2);
    double shift = 0.0;
    for (std::size_t i = 0; i <= steps_px.size(); ++i) {
      if (i > 0) shift += steps_px[i - 1];
      cv::Mat bgr;
      const cv::Rect view(static_cast<int>(shift), 0, kWidth, kHeight);
      cv::Mat gray = to_8bit((i < other_wall_from ? first : other)(view));
      if (near.row < kHeight) {
        const int side = kHeight - near.row;
        const cv::Rect nearer(static_cast<int>(shift) * near.times, 0, kWidth, side);
        to_8bit(other(nearer)).copyTo(gray(cv::Rect(0, near.row, kWidth, side)));
      }
      cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
      write_image(folder_ / (std::to_string(i) + ".png"), bgr);
    }
    Lens lens;
    lens.width = kWidth;
    lens.height = kHeight;
    lens.fx = lens.fy = 160.0;
    lens.cx = 160.0;
    lens.cy = 120.0;
    write_atomic(folder_ / "lens.yaml", lens_yaml(lens, "test"));
    return FrameSource(Observations::open(folder_, folder_ / "lens.yaml"), options);
  }

  static PreprocessOptions plain() {
    PreprocessOptions options;
    options.devignette = false;
    return options;
  }

  std::filesystem::path folder_;
};

}  // namespace rugae::testing
