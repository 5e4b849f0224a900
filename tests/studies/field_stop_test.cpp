// The whole loop through a circular field stop, as capsules have it: the black around the picture
// is in no reflection, no track, no depth and no map, and does not spoil the path.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/files.h"
#include "dataset/estimate.h"
#include "dataset/image_io.h"
#include "recon/frame_follower.h"
#include "recon/pipeline.h"
#include "render/simulate.h"
#include "tests/studies/in_temporary_folder.h"
#include "validate/evaluate.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kPath_mm = 24.0;
constexpr int kFrames = 18;

class FieldStopLoop : public InTemporaryFolder {
 protected:
  void simulate_through(const std::string& stop) {
    write_atomic(folder_ / "camera.yaml",
                 "name: small\ndiameter_mm: 5\n"
                 "lens: {width: 240, height: 240, horizontal_fov_deg: 100, k1: -0.15, k2: 0.02" +
                     stop +
                     "}\n"
                     "sensor: {pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, "
                     "read_noise_e: 10, shutter: global}\n");
    write_atomic(folder_ / "path.yaml",
                 fmt::format("like: '1'\nlength_cm: {}\npasses: 1\n", 0.1 * kPath_mm));
    SimulateOptions options;
    options.camera = (folder_ / "camera.yaml").string();
    options.trajectory = (folder_ / "path.yaml").string();
    options.resolution = "coarse";
    options.frames = kFrames;
    simulate(options, folder_ / "data", progress_);
  }
  Progress progress_{Progress::Output::silent};
};

TEST_F(FieldStopLoop, NothingOfTheBlackIsReconstructed) {
  simulate_through(", field_stop: circle, field_stop_radius: 0.95");
  const Observations observations = Observations::open(folder_ / "data");
  const Lens& lens = observations.lens();
  ASSERT_FALSE(lens.passes_stop({2.0, 2.0}));
  const cv::Mat picture = observations.image(0);
  ASSERT_EQ(cv::norm(cv::Mat(picture, cv::Rect(0, 0, 20, 20)), cv::NORM_INF), 0.0);

  ReconOptions options;
  options.pictures = false;
  // Tracks, as the pipeline makes them.
  const FrameSource frames(observations, options.preprocess);
  const Followed followed = follow_frames(frames, options, progress_);
  std::size_t sights = 0;
  for (const Track& track : followed.tracks)
    for (const auto& o : track.observations) {
      const auto pixel = lens.project(Vec3(o.ray.x(), o.ray.y(), 1.0));
      ASSERT_TRUE(pixel && lens.contains(*pixel)) << o.pixel.transpose();
      ++sights;
    }
  EXPECT_GT(sights, 1000u);

  const Estimate estimate = reconstruct(observations, options, folder_ / "estimate", progress_);
  const EstimateLayout layout{folder_ / "estimate"};
  // Depth ends where the picture ends.
  int depths = 0;
  for (int i = 0; i < kFrames; ++i) {
    if (!fs::exists(layout.depth(i))) continue;
    const cv::Mat depth = read_exr(layout.depth(i));
    ++depths;
    for (int y = 0; y < depth.rows; ++y)
      for (int x = 0; x < depth.cols; ++x)
        ASSERT_TRUE(lens.passes_stop({x + 0.5, y + 0.5}) || std::isnan(depth.at<float>(y, x)))
            << i << ": " << x << " " << y;
  }
  EXPECT_GE(depths, 2);
  // Every point of the map was in the picture of a frame, and none has the colour of the black.
  std::size_t unseen = 0, black = 0;
  for (std::size_t v = 0; v < estimate.map.vertices.size(); ++v) {
    bool seen = false;
    for (int i = 0; i < kFrames && !seen; ++i) {
      if (estimate.states[i] != FrameState::keyframe) continue;
      const auto pixel =
          lens.project(estimate.world_from_camera[i].inverse() * estimate.map.vertices[v]);
      seen = pixel && lens.contains(*pixel);
    }
    unseen += seen ? 0 : 1;
    constexpr float kBlack = 8.0f / 255.0f;
    black += estimate.map.colors[v].maxCoeff() <= kBlack ? 1 : 0;
  }
  EXPECT_GT(estimate.map.vertices.size(), 1000u);
  EXPECT_EQ(unseen, 0u);
  EXPECT_EQ(black, 0u);

  const json m = evaluate(folder_ / "data", folder_ / "estimate", progress_);
  // A slow path near the wall: nothing excuses a lost frame.
  EXPECT_EQ(m.at("tracking").at("tracked_share"), 1.0);
  // An edge that stands still among the tracks holds the camera back and bends its path. 0.06 mm
  // were measured with it left out; 1 % of the path is a failure.
  EXPECT_TRUE(m.at("trajectory").at("ate_sim3_rmse_mm").get<double>() <= 0.01 * kPath_mm)
      << m.at("trajectory").at("ate_sim3_rmse_mm");
  // Shading between sparse points: 0.015 were measured.
  EXPECT_TRUE(m.at("depth").at("sim3").at("abs_rel").get<double>() <= 0.04)
      << m.at("depth").at("sim3").at("abs_rel");
  // Most of what the stop lets through has depth; the truth has none outside it.
  EXPECT_TRUE(m.at("depth").at("sim3").at("valid_share").get<double>() >= 0.75)
      << m.at("depth").at("sim3").at("valid_share");
}

}  // namespace
}  // namespace rugae
