// Frames of a camera with its light beside it: the reconstruction is in millimetres.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "dataset/estimate.h"
#include "dataset/observations.h"
#include "recon/pipeline.h"
#include "render/simulate.h"
#include "validate/evaluate.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

TEST(MetricScale, OfALightBesideTheCamera) {
  const fs::path root = fs::path(testing::TempDir()) / ("rugae_metric_" + std::to_string(getpid()));
  fs::remove_all(root);
  make_folder(root);
  const auto write_camera = [&](const std::string& name, const std::string& lights) {
    write_atomic(
        root / (name + ".yaml"),
        "name: " + name +
            "\nframes_in_paper: 2400\ndiameter_mm: 10\n"
            "lens: {model: brown_conrady, width: 320, height: 240, "
            "horizontal_fov_deg: 90, k1: -0.15, k2: 0.02}\nvignetting: {cos4: true, v1: -0.1}\n"
            "sensor: {pixel_pitch_um: 4, fps: 30, bit_depth: 10, full_well_e: 12000, "
            "read_noise_e: 10}\n" +
            lights);
  };
  write_camera("beside", "lights: [{offset_mm: [3, 0, 0]}]\n");
  write_camera("centre", "");
  Progress progress(Progress::Output::silent);
  const auto made = [&](const std::string& name) {
    SimulateOptions simulate_options;
    simulate_options.camera = (root / (name + ".yaml")).string();
    simulate_options.trajectory = std::string("4");
    simulate_options.first = 60;
    simulate_options.render.truth.labels = LabelSet::none();
    simulate_options.render.truth.labels.depth = true;
    simulate(simulate_options, root / name, progress);
    ReconOptions options;
    options.method = "dense";
    options.pictures = false;
    options.dense.max_depth_maps = 4;
    reconstruct(Observations::open(root / name), options, root / (name + "_estimate"), progress);
    return evaluate(root / name, root / (name + "_estimate"), progress);
  };
  const nlohmann::json beside = made("beside"), centre = made("centre");
  ASSERT_FALSE(beside["scale"].is_null());
  const double error = beside["scale"]["error_share"], sigma = beside["scale"]["sigma_share"];
  std::printf("lengths %+.2f %% off, sigma %.2f %%\n", 100.0 * error, 100.0 * sigma);
  EXPECT_LE(sigma, 0.15);  // of 60 frames 320 px wide
  EXPECT_LE(std::abs(error), 3.0 * sigma);
  // In millimetres without any help: the path needs no scale.
  const double se3_mm = beside["trajectory"]["ate_se3_rmse_mm"];
  EXPECT_LE(se3_mm, 1.5);

  EXPECT_TRUE(centre["scale"].is_null());
  EXPECT_FALSE(read_estimate(root / "centre_estimate").scale_sigma_share.has_value());
  EXPECT_TRUE(read_estimate(root / "beside_estimate").scale_sigma_share.has_value());
  fs::remove_all(root);
}

}  // namespace
}  // namespace rugae
