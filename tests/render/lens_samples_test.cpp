// Light gathered over the pixel, the aperture and the exposure, against closed forms.
#include "render/lens_samples.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <opencv2/core.hpp>

#include "tests/render/moving_world.h"

namespace rugae {
namespace {

using test::lambert;

constexpr double kFps = 30.0;

// Bright where x > at_mm, black elsewhere; on the plane z = distance.
struct EdgeScene {
  Camera camera = test::small_camera(96, 72);
  TriangleMesh wall;
  Material edge, bright;

  explicit EdgeScene(double distance_mm, double at_mm = 0.0)
      : wall(test::plane_mesh(distance_mm, 400.0, 2)),
        edge([at_mm](std::span<const MaterialQuery> queries, std::span<MucosaSample> out) {
          for (std::size_t i = 0; i < queries.size(); ++i)
            out[i] = lambert(queries[i].rest_position_mm.x() > at_mm ? 0.8f : 0.0f);
        }),
        bright(test::constant_material(lambert(0.8f))) {
    camera.lens.k1 = camera.lens.k2 = camera.lens.p1 = camera.lens.p2 = 0.0;
  }
  // Share of each pixel's light that comes from the bright side; the same samples with and without
  // the edge.
  cv::Mat share(const FrameView& view, const LensSampling& sampling) const {
    const FrameRenderer with(Surface(wall, edge), camera,
                             {.vignetting = false, .labels = LabelSet::none()});
    const FrameRenderer all(Surface(wall, bright), camera,
                            {.vignetting = false, .labels = LabelSet::none()});
    const cv::Mat a = with.gather(view, sampling), b = all.gather(view, sampling);
    cv::Mat ratio(a.size(), CV_32F);
    for (int y = 0; y < a.rows; ++y)
      for (int x = 0; x < a.cols; ++x)
        ratio.ptr<float>(y)[x] = a.ptr<Vec3f>(y)[x][0] / b.ptr<Vec3f>(y)[x][0];
    return ratio;
  }
};

FrameView at_origin() {
  FrameView view;
  view.fps = kFps;
  return view;
}

// The mean of `profile` over the pixel whose centre is `s` px from the edge.
template <typename Profile>
double over_pixel(const Profile& profile, double s) {
  constexpr int kSteps = 200;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) sum += profile(s + (i + 0.5) / kSteps - 0.5);
  return sum / kSteps;
}

// An edge through the pixel's area: the share is the area on its bright side, to one of n strata.
TEST(LensSamples, APixelIsTheMeanOverItsArea) {
  const EdgeScene scene(20.0, 0.2);
  const cv::Mat share = scene.share(at_origin(), {.samples = 128});
  const double edge_px = scene.camera.lens.cx + scene.camera.lens.fx * 0.2 / 20.0;
  constexpr double kStratum = 1.0 / 128.0 + 2e-3;  // rows far off the axis: directions are linear
  int between = 0;
  for (int y = 0; y < 72; ++y)
    for (int x = 0; x < 96; ++x) {
      const double expected = std::clamp(x + 1.0 - edge_px, 0.0, 1.0);
      // The emitter at the camera's centre lights the wall alike within a pixel.
      ASSERT_TRUE(std::abs(share.ptr<float>(y)[x] - expected) <= kStratum)
          << x << " " << y << " " << share.ptr<float>(y)[x] << " " << expected;
      between += expected > 0.1 && expected < 0.9;
    }
  EXPECT_EQ(between, 72);
}

// Circle of confusion: radius R = fx A |1/z - 1/focus| px. Across an edge its share on one side is
// 1/2 + (asin(s/R) + (s/R) sqrt(1 - (s/R)^2)) / pi.
TEST(LensSamples, TheCircleOfConfusionIsAsComputed) {
  constexpr double kDistance_mm = 10.0, kFocus_mm = 20.0, kAperture_mm = 2.0;
  const EdgeScene scene(kDistance_mm);
  const LensSampling sampling{
      .samples = 512, .aperture_radius_mm = kAperture_mm, .focus_distance_mm = kFocus_mm};
  const cv::Mat share = scene.share(at_origin(), sampling);
  const double radius_px =
      scene.camera.lens.fx * kAperture_mm * std::abs(1.0 / kDistance_mm - 1.0 / kFocus_mm);
  EXPECT_NEAR(radius_px, 4.032, 1e-3);
  const auto disc = [&](double s) {
    const double r = std::clamp(s / radius_px, -1.0, 1.0);
    return 0.5 + (std::asin(r) + r * std::sqrt(1.0 - r * r)) / kPi;
  };
  // Light falls off by up to 2 % across the circle, and 512 samples err by less than 0.01.
  constexpr double kAgreement = 0.025;
  for (int y = 30; y < 42; ++y)
    for (int x = 36; x < 60; ++x) {
      const double expected = over_pixel(disc, x + 0.5 - scene.camera.lens.cx);
      ASSERT_TRUE(std::abs(share.ptr<float>(y)[x] - expected) <= kAgreement)
          << x << " " << y << " " << share.ptr<float>(y)[x] << " " << expected;
    }
}

TEST(LensSamples, WhatIsInFocusIsSharp) {
  const EdgeScene scene(20.0);
  const cv::Mat share = scene.share(
      at_origin(), {.samples = 64, .aperture_radius_mm = 2.0, .focus_distance_mm = 20.0});
  for (int y = 0; y < 72; ++y)
    for (int x = 0; x < 96; ++x) {
      const double s = x + 0.5 - scene.camera.lens.cx;
      if (std::abs(s) > 0.51) {
        ASSERT_EQ(share.ptr<float>(y)[x], s > 0.0 ? 1.0f : 0.0f) << x << " " << y;
      }
    }
}

// A camera that turns at a steady rate through a rolling shutter: in every row the edge wanders
// from one side of its sharp place to the other during the exposure.
TEST(LensSamples, ATurningCameraSmearsTheBentEdge) {
  const EdgeScene scene(20.0);
  constexpr double kTurn_rad_s = 3.0, kExposure_s = 0.5 / kFps;
  const double row_time_s = 0.9 / (kFps * 72);
  const FrameRenderer renderer(Surface(scene.wall, scene.bright), scene.camera,
                               {.vignetting = false, .labels = LabelSet::none()});
  const SceneMotion motion(renderer.wall(), {},
                           [](double frame) {
                             const double turned_rad = kTurn_rad_s * (frame - 1.0) / kFps;
                             return Rigid3(Quat(Eigen::AngleAxisd(turned_rad, Vec3::UnitY())),
                                           Vec3::Zero());
                           },
                           {.frames = 3, .fps = kFps, .height = 72, .row_time_s = row_time_s});
  const cv::Mat share = scene.share(motion.view(1), {.samples = 256, .exposure_s = kExposure_s});
  const auto edge_px = [&](double t) {
    return scene.camera.lens.cx - scene.camera.lens.fx * std::tan(kTurn_rad_s * t);
  };
  constexpr double kAgreement = 0.02;  // quasi-random, and an edge at almost steady speed
  for (int y = 0; y < 72; ++y) {
    const double middle_s = (y - 35.5) * row_time_s;
    const double first = edge_px(middle_s + 0.5 * kExposure_s),
                 last = edge_px(middle_s - 0.5 * kExposure_s);
    const auto ramp = [&](double x) { return std::clamp((x - first) / (last - first), 0.0, 1.0); };
    for (int x = 0; x < 96; ++x)
      ASSERT_TRUE(std::abs(share.ptr<float>(y)[x] - over_pixel(ramp, x + 0.5)) <= kAgreement)
          << x << " " << y << " " << share.ptr<float>(y)[x] << " " << over_pixel(ramp, x + 0.5);
  }
}

// One long exposure of a moving wall by a moving camera is the mean of the short ones it consists
// of. The short ones are the sharp instants of the same motion sampled 64 times as often; the wall
// moves at a steady speed, so that straight lines between frames are the same for both.
TEST(LensSamples, ALongExposureIsTheMeanOfShortOnes) {
  constexpr int kFiner = 64, kShort = 32;  // half of the frame's time is exposed
  const test::MovingWorld world(64, 48, 4, 0.0);
  const Material stripes = [](std::span<const MaterialQuery> queries, std::span<MucosaSample> out) {
    for (std::size_t i = 0; i < queries.size(); ++i)
      out[i] = lambert(0.5f + 0.4f * std::sin(queries[i].rest_position_mm.x()));
  };
  const FrameRenderer renderer(Surface(world.rest, stripes), world.camera, {true, false});
  const auto pose = [&](double frame) { return world.pose(5.0 + 4.0 * (frame - 1.0)); };
  const auto wall_at = [&](double frame, std::vector<Vec3>& v) {
    v = world.rest.vertices;
    for (Vec3& p : v) p *= 1.0 + 0.03 * (frame - 1.0) * std::sin(0.1 * p.x());
  };
  const SceneMotion whole(renderer.wall(),
                          [&](double t, std::vector<Vec3>& v) { wall_at(t * kFps, v); }, pose,
                          {.frames = 3, .fps = kFps, .height = 48, .moves_within = true});
  // The fine frame i is the instant (i + 1/2) / 64 of the coarse ones.
  const double fine_fps = kFps * kFiner;
  const SceneMotion fine(
      renderer.wall(),
      [&](double t, std::vector<Vec3>& v) { wall_at((t * fine_fps + 0.5) / kFiner, v); },
      [&](double frame) { return pose((frame + 0.5) / kFiner); },
      {.frames = 3 * kFiner, .fps = fine_fps, .height = 48});
  const cv::Mat one = renderer.gather(whole.view(1), {.samples = 512, .exposure_s = 0.5 / kFps});
  cv::Mat mean(one.size(), CV_32FC3, cv::Scalar::all(0.0));
  for (int i = 0; i < kShort; ++i)
    mean += renderer.gather(fine.view(kFiner - kShort / 2 + i),
                            {.samples = 16, .frame = static_cast<std::uint32_t>(i)});
  mean /= kShort;
  const cv::Mat sharp = renderer.gather(whole.view(1), {.samples = 512});
  double error = 0.0, blur = 0.0, light = 0.0, worst = 0.0;
  for (int i = 0; i < 64 * 48; ++i) {
    const double l = mean.ptr<Vec3f>()[i][0], e = std::abs(one.ptr<Vec3f>()[i][0] - l);
    light += l;
    error += e;
    worst = std::max(worst, e / l);
    blur += std::abs(sharp.ptr<Vec3f>()[i][0] - l);
  }
  // Both are quasi-random means of 512 samples; outlines, where one sample weighs most, err most.
  constexpr double kMean = 0.003, kWorst = 0.05;
  EXPECT_TRUE(error / light <= kMean) << error / light;
  EXPECT_TRUE(worst <= kWorst) << worst;
  EXPECT_GT(blur / light, 10.0 * kMean);
}

TEST(LensSamples, OneAndTwoThreadsGatherTheSame) {
  const test::MovingWorld world(64, 48, 3, 0.8);
  const FrameRenderer renderer = world.renderer({});
  const SceneMotion motion = world.motion(renderer);
  const auto gather = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] {
      return renderer.gather(motion.view(4), {.samples = 5,
                                              .exposure_s = 0.3 / kFps,
                                              .aperture_radius_mm = 0.3,
                                              .focus_distance_mm = 20.0,
                                              .frame = 4});
    });
  };
  const cv::Mat one = gather(1), two = gather(2);
  EXPECT_EQ(std::memcmp(one.data, two.data, one.total() * one.elemSize()), 0);
}

// The mucosa looked up once a pixel is that looked up for every sample, up to what lies between the
// points of one footprint.
TEST(LensSamples, MaterialsOfTheSharpFrameServeTheSamples) {
  const Scene scene = load_scene({.name_or_path = "stomach", .seed = 1, .resolution = "coarse"});
  Vec3 inside = Vec3::Zero();
  int count = 0;
  for (std::size_t i = 0; i < scene.wall.vertices.size(); ++i)
    if (scene.regions[i] == Region::body) {
      inside += scene.wall.vertices[i];
      ++count;
    }
  FrameView view;
  view.camera = RowPoses(Rigid3(test::random_rotation(2), inside / count));
  const FrameRenderer renderer(scene, test::small_camera(192, 144), {.keep_materials = true});
  const CleanFrame sharp = renderer.render(view, nullptr, nullptr);
  const LensSampling sampling{.samples = 16};
  const cv::Mat once = renderer.gather(view, sampling, nullptr, sharp.materials),
                each = renderer.gather(view, sampling);
  double difference = 0.0, apart = 0.0, whole = 0.0;
  int same = 0;
  for (int i = 0; i < 192 * 144; ++i) {
    const Vec3f a = once.ptr<Vec3f>()[i], b = each.ptr<Vec3f>()[i];
    difference += a.sum() - b.sum();
    apart += (a - b).cwiseAbs().sum();
    whole += b.sum();
    same += a == b;
  }
  EXPECT_LT(same, 1000);                          // it does something
  EXPECT_LE(std::abs(difference), 5e-4 * whole);  // no lighter, no darker
  EXPECT_LE(apart, 0.01 * whole);                 // and nowhere far off
}

// Rays that a wide aperture sends elsewhere must not take the pixel's material along: stripes out
// of focus vanish as they do when every ray asks for its own.
TEST(LensSamples, RaysThatLandElsewhereAskForTheirOwnMaterial) {
  const TriangleMesh wall = test::sphere_mesh(5, 20.0);
  const Material stripes = [](std::span<const MaterialQuery> queries, std::span<MucosaSample> out) {
    for (std::size_t i = 0; i < queries.size(); ++i)
      out[i] = lambert(0.5f + 0.4f * std::sin(queries[i].rest_position_mm.x()));
  };
  FrameView view;
  view.camera = RowPoses(Rigid3());
  const FrameRenderer renderer(Surface(wall, stripes), test::small_camera(),
                               {.vignetting = false, .keep_materials = true});
  const CleanFrame sharp = renderer.render(view, nullptr, nullptr);
  // A blur of fx A |1/20 - 1/8| = 6 px, half a stripe. One ray in 36 lands within the footprint,
  // and takes a material up to a pixel away, which differs by a fifth.
  const LensSampling sampling{.samples = 16, .aperture_radius_mm = 2.0, .focus_distance_mm = 8.0};
  const cv::Mat once = renderer.gather(view, sampling, nullptr, sharp.materials),
                each = renderer.gather(view, sampling);
  double apart = 0.0, whole = 0.0;
  for (int i = 0; i < 96 * 72; ++i) {
    apart += (once.ptr<Vec3f>()[i] - each.ptr<Vec3f>()[i]).cwiseAbs().sum();
    whole += each.ptr<Vec3f>()[i].sum();
  }
  EXPECT_LE(apart, 0.01 * whole);
}

}  // namespace
}  // namespace rugae
