// A field stop paints a black border that stands still while the wall moves: no stage may take it
// for wall. A texture moves to the left behind a circular stop.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/files.h"
#include "dataset/image_io.h"
#include "recon/align.h"
#include "recon/features.h"
#include "recon/flow.h"
#include "recon/keyframes.h"
#include "recon/map.h"
#include "recon/preprocess/reflections.h"
#include "synthetic_texture.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using testing::draw;
using testing::Texture;
using testing::to_8bit;

constexpr int kWidth = 320, kHeight = 240;
constexpr double kRadiusPx = 0.9 * 120.0;
const Vec2 kCentre(160.0, 120.0);

Lens stopped_lens() {
  Lens lens;
  lens.width = kWidth;
  lens.height = kHeight;
  lens.fx = lens.fy = 160.0;
  lens.cx = kCentre.x();
  lens.cy = kCentre.y();
  lens.stop = {StopShape::circle, 0.9};
  return lens;
}

// Negative outside.
double px_from_stop(const Vec2& p) { return kRadiusPx - (p - kCentre).norm(); }

cv::Mat field() {
  return to_8bit(draw(kWidth, kHeight, [](const Vec2& p) { return px_from_stop(p) >= 0.0; }));
}

cv::Mat seen_through_stop(double shift_px) {
  static const Texture texture(2, 7.0, 60.0);
  return to_8bit(draw(kWidth, kHeight, [&](const Vec2& p) {
    return px_from_stop(p) >= 0.0 ? 0.2 + 0.6 * texture(p + Vec2(shift_px, 0.0)) : 0.0;
  }));
}

Frame frame_of(int index, const cv::Mat& gray) {
  Frame frame;
  frame.index = index;
  frame.gray = gray;
  frame.reflection = cv::Mat::zeros(gray.size(), CV_8U);
  frame.valid = field();
  return frame;
}

TEST(FieldStop, FlowNearItIsThatOfTheWall) {
  constexpr double kShiftPx = 12.0;
  const cv::Mat first = seen_through_stop(0.0), second = seen_through_stop(kShiftPx);
  const auto median_error_px = [&](const cv::Mat& valid) {
    const cv::Mat flow = farneback_flow(first, second, {}, valid);
    std::vector<double> errors;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        // where the wall does not go out of sight, and the edge lies within Farneback's window
        const Vec2 p(x + 0.5, y + 0.5), q = p - Vec2(kShiftPx, 0.0);
        if (std::min(px_from_stop(p), px_from_stop(q)) < 2.0 || px_from_stop(p) > 12.0) continue;
        errors.push_back(cv::norm(flow.at<cv::Vec2f>(y, x) - cv::Vec2f(-12.0F, 0.0F)));
      }
    std::ranges::nth_element(errors, errors.begin() + static_cast<long>(errors.size() / 2));
    return errors[errors.size() / 2];
  };
  const double told = median_error_px(field()), not_told = median_error_px({});
  EXPECT_TRUE(told <= 1.0) << told;
  EXPECT_TRUE(told <= 0.5 * not_told) << told << " " << not_told;
}

TEST(FieldStop, EvenLightDoesNotSeeIt) {
  // the same wall without the stop, away from where the blur reaches over its edge
  const Texture texture(2, 7.0, 60.0);
  const cv::Mat open = even_light(to_8bit(
                    draw(kWidth, kHeight, [&](const Vec2&p) { return 0.2 + 0.6 * texture(p); }))),
                stopped = even_light(seen_through_stop(0.0), field());
  double sum = 0.0;
  int count = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double depth = px_from_stop({x + 0.5, y + 0.5});
      if (depth < 0.0)
        ASSERT_EQ(stopped.at<unsigned char>(y, x), 128);
      else if (depth < 3.0)
        sum += std::abs(stopped.at<unsigned char>(y, x) - open.at<unsigned char>(y, x)), ++count;
    }
  // Half of the surroundings are unknown there; the black would make it more than 60 of 255.
  EXPECT_TRUE(sum / count <= 20.0) << sum / count;
}

TEST(FieldStop, CorrespondencesKeepAPatchAway) {
  constexpr double kShiftPx = 10.0;
  const AlignOptions options;
  const auto pair = align(frame_of(0, seen_through_stop(0.0)),
                          frame_of(1, seen_through_stop(kShiftPx)), options, 1);
  ASSERT_TRUE(pair);
  ASSERT_GE(pair->reference_px.size(), 300u);
  const double radius_px = options.patch_radius_px * kWidth / 640.0;
  std::vector<double> errors;
  for (std::size_t i = 0; i < pair->reference_px.size(); ++i) {
    EXPECT_GE(px_from_stop(pair->reference_px[i]), radius_px - 1.0);
    EXPECT_GE(px_from_stop(pair->moving_px[i]), radius_px - 2.0);
    errors.push_back((pair->reference_px[i] - pair->moving_px[i] - Vec2(kShiftPx, 0.0)).norm());
  }
  std::ranges::sort(errors);
  // as without a stop: 8-bit steps on waves of 7 px
  EXPECT_TRUE(errors[errors.size() / 2] <= 0.05) << errors[errors.size() / 2];
  EXPECT_TRUE(errors.back() <= 0.75) << errors.back();
}

// A plain folder of frames in which the wall moves by `step_px` a frame.
TEST(FieldStop, KeyFramesAreThoseOfTheWallThatIsSeen) {
  const fs::path folder =
      fs::temp_directory_path() / ("rugae_field_stop_" + std::to_string(::getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder);
  constexpr double kStepPx = 7.0;
  for (int i = 0; i < 8; ++i) {
    cv::Mat bgr;
    cv::cvtColor(seen_through_stop(kStepPx * i), bgr, cv::COLOR_GRAY2BGR);
    write_image(folder / (std::to_string(i) + ".png"), bgr);
  }
  write_atomic(folder / "lens.yaml", lens_yaml(stopped_lens(), "test"));
  PreprocessOptions preprocess;
  preprocess.devignette = false;
  const FrameSource frames(Observations::open(folder, folder / "lens.yaml"), preprocess);
  KeyframeOptions options;
  options.mean_flow_px = 26.0;  // 13 at this width: two steps
  KeyframeSelector selector(frames, options);
  selector.advance(frames.size());
  const Keyframes keys = selector.keyframes();
  EXPECT_EQ(keys.frames, (std::vector<int>{0, 2, 4, 6}));
  for (std::size_t k = 1; k < keys.frames.size(); ++k)
    EXPECT_NEAR(keys.mean_flow_px[k], 2.0 * kStepPx, 0.8);
  fs::remove_all(folder);
}

TEST(FieldStop, ItsEdgeIsNoReflection) {
  cv::Mat gray = seen_through_stop(0.0) / 2;
  cv::Mat spots = cv::Mat::zeros(gray.size(), CV_8U);
  for (int i = 0; i < 4; ++i) cv::circle(spots, {100 + 40 * i, 120}, 3, 255, cv::FILLED);
  // a bright wall all along the edge
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (const double d = px_from_stop({x + 0.5, y + 0.5}); d >= 0.0 && d < 20.0)
        gray.at<unsigned char>(y, x) = 180;
  gray.setTo(250, spots);
  const cv::Mat found = detect_reflections(gray, {}, field());
  EXPECT_GE(cv::countNonZero(found & spots), cv::countNonZero(spots) * 9 / 10);
  int near = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      near += found.at<unsigned char>(y, x) != 0 && px_from_stop({x + 0.5, y + 0.5}) < 8.0;
  EXPECT_EQ(near, 0);
  EXPECT_EQ(cv::countNonZero(found & ~field()), 0);
}

class FieldStopFeatures : public ::testing::TestWithParam<FeatureMethod> {};
TEST_P(FieldStopFeatures, NoneIsOfItsEdge) {
  const cv::Mat first = seen_through_stop(0.0), second = seen_through_stop(9.0);
  const FeatureMatches matches = match_features(GetParam(), first, second, field());
  ASSERT_GE(matches.first_px.size(), 30u);
  std::size_t still = 0;
  for (std::size_t i = 0; i < matches.first_px.size(); ++i) {
    EXPECT_GE(px_from_stop(matches.first_px[i]), 12.0);
    EXPECT_GE(px_from_stop(matches.second_px[i]), 12.0);
    still += (matches.first_px[i] - matches.second_px[i]).norm() < 2.0;
  }
  EXPECT_EQ(still, 0u);
}
INSTANTIATE_TEST_SUITE_P(All, FieldStopFeatures, ::testing::ValuesIn(kFeatureMethods),
                         [](const auto& info) {
                           std::string name = name_of(info.param);
                           std::erase(name, '-');
                           return name;
                         });

TEST(FieldStop, DepthOfTheMapEndsThere) {
  const Lens lens = stopped_lens();
  TriangleMesh wall;
  wall.vertices = {{-500, -500, 30}, {500, -500, 30}, {500, 500, 30}, {-500, 500, 30}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  const cv::Mat depth = keyframe_depth(wall, Rigid3(), lens);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      ASSERT_EQ(std::isnan(depth.at<float>(y, x)), !lens.passes_stop({x + 0.5, y + 0.5}))
          << x << " " << y;
}

}  // namespace
}  // namespace rugae
