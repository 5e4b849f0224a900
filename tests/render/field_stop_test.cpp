// A field stop: what it covers is black, without labels, and no flow leads there.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "core/files.h"
#include "dataset/layout.h"
#include "render/frame.h"
#include "render/sensor.h"
#include "tests/message_of.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

TEST(FieldStop, ShapesAreAsTheyAreNamed) {
  const FieldStop circle{StopShape::circle, 0.5}, octagon{StopShape::octagon, 0.5}, full;
  // of radius 0.5 * 100 px; the octagon's corners lie at R / cos(pi / 8)
  const double corner = 50.0 / std::cos(std::atan(1.0) / 2.0);
  for (int i = 0; i < 360; ++i) {
    const double angle = i * std::atan(1.0) / 45.0;
    const Vec2 ray(std::cos(angle), std::sin(angle));
    // distance to the nearest side: R / cos(angle from the side's normal)
    const double turn = std::remainder(angle, std::atan(1.0));
    const double side = 50.0 / std::cos(turn);
    EXPECT_TRUE(circle.passes(49.999 * ray, 100.0));
    EXPECT_FALSE(circle.passes(50.001 * ray, 100.0));
    EXPECT_TRUE(octagon.passes((side - 1e-3) * ray, 100.0)) << i;
    EXPECT_FALSE(octagon.passes((side + 1e-3) * ray, 100.0)) << i;
    EXPECT_LE(side, corner + 1e-9);
    EXPECT_TRUE(full.passes(1e6 * ray, 100.0));
  }
}

TEST(FieldStop, FilesKeepItAndMistakesAreNamed) {
  const auto file = std::filesystem::temp_directory_path() / "rugae_field_stop.yaml";
  Lens lens = load_camera("misumi-v5506").lens;
  EXPECT_EQ(lens_yaml(lens, "").find("field_stop"), std::string::npos);
  lens.stop = {StopShape::octagon, 0.95};
  const std::string text = lens_yaml(lens, "");
  write_atomic(file, text);
  EXPECT_EQ(load_lens(file).stop.shape, StopShape::octagon);
  EXPECT_EQ(load_lens(file).stop.radius, 0.95);
  EXPECT_EQ(lens.pinhole().stop.shape, StopShape::full);
  write_atomic(file, text + "field_stop_radus: 1\n");
  EXPECT_NE(message_of([&] { load_lens(file); }).find("did you mean 'field_stop_radius'?"),
            std::string::npos);
  std::string broken = text;
  broken.replace(broken.find("octagon"), 7, "octagn");
  write_atomic(file, broken);
  EXPECT_NE(message_of([&] { load_lens(file); })
                .find("field_stop is 'octagn', expected one of: full, circle, octagon; did you "
                      "mean 'octagon'?"),
            std::string::npos);
  std::filesystem::remove(file);
}

TEST(FieldStop, WhatItCoversIsBlackAndHasNoLabels) {
  Camera camera = test::small_camera();
  camera.sensor = {6.0, 30.0, 10, 18000.0, 10.0};
  const TriangleMesh wall = test::plane_mesh(20.0, 2000.0, 3);  // the renderers refer to it
  const Material material = test::constant_material(test::lambert(0.5f));
  const FrameRenderer open(Surface(wall, material), camera, {});
  camera.lens.stop = {StopShape::circle, 0.7};
  const FrameRenderer stopped(Surface(wall, material), camera, {});
  const Rigid3 pose, next(Quat::Identity(), Vec3(2.0, 0.0, 0.0));
  CleanFrame frame = stopped.render(pose, &next), whole = open.render(pose, &next);
  const SensorModel sensor(camera.sensor, {.blanked = blanked_by_stop(camera.lens)});
  const cv::Mat bgr =
      sensor.digitise(frame.radiance, sensor.expose(frame.radiance), 0, frame.truth.masks).bgr;
  int covered = 0, left = 0;
  for (int y = 0; y < camera.lens.height; ++y)
    for (int x = 0; x < camera.lens.width; ++x) {
      const auto mask = frame.truth.masks.at<unsigned char>(y, x);
      const float depth_mm = frame.truth.depth_mm.at<float>(y, x);
      const auto flow = frame.truth.flow_px.at<cv::Vec2f>(y, x);
      if (!camera.lens.contains({x + 0.5, y + 0.5})) {
        ++covered;
        EXPECT_EQ(bgr.at<cv::Vec3b>(y, x), cv::Vec3b(0, 0, 0));
        EXPECT_EQ(mask, 0);
        EXPECT_TRUE(std::isnan(depth_mm) && std::isnan(flow[0]));
        EXPECT_TRUE(std::isnan(frame.truth.normal.at<cv::Vec3f>(y, x)[0]));
        continue;
      }
      EXPECT_EQ(depth_mm, whole.truth.depth_mm.at<float>(y, x));
      EXPECT_EQ(frame.radiance.at<cv::Vec3f>(y, x), whole.radiance.at<cv::Vec3f>(y, x));
      const auto free_flow = whole.truth.flow_px.at<cv::Vec2f>(y, x);
      const bool lands = !std::isnan(free_flow[0]) &&
                         camera.lens.contains({x + 0.5 + free_flow[0], y + 0.5 + free_flow[1]});
      EXPECT_EQ((mask & kMaskFlowValid) != 0, lands);
      left += !lands;
    }
  EXPECT_GT(covered, 100);
  EXPECT_GT(left, 10);
  EXPECT_TRUE(blanked_by_stop(Lens{}).empty());
}

}  // namespace
}  // namespace rugae
