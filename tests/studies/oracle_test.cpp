// Stages by one who knows the truth, on a small dataset: what each of them must give.

#include "studies/oracle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "dataset/observations.h"
#include "recon/pipeline.h"
#include "render/simulate.h"
#include "studies/true_motion.h"
#include "studies/variant.h"
#include "tests/studies/in_temporary_folder.h"
#include "validate/evaluate.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 16;

class WithOracle : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / fmt::format("rugae_oracle_{}", getpid());
    fs::create_directories(folder_);
    write_atomic(folder_ / "small.yaml",
                 "name: small\nframes_in_paper: 0\ndiameter_mm: 5\n"
                 "lens: {model: brown_conrady, width: 240, height: 180, horizontal_fov_deg: 90, "
                 "k1: -0.08}\n"
                 "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 10000, "
                 "read_noise_e: 5, shutter: global}\n");
    write_atomic(folder_ / "short.yaml", "like: \"1\"\nlength_cm: 5\npasses: 1\n");
    SimulateOptions options;
    options.resolution = "coarse";
    options.camera = (folder_ / "small.yaml").string();
    options.trajectory = (folder_ / "short.yaml").string();
    options.frames = kFrames;
    Progress progress(Progress::Output::silent);
    simulate(options, folder_ / "data", progress);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static nlohmann::json metrics_with(Replace replace) {
    ReconOptions options;
    options.pictures = false;
    options.keyframes.mean_flow_px = 20.0;
    Progress progress(Progress::Output::silent);
    const Observations observations = Observations::open(folder_ / "data");
    const FrameSource frames(observations, options.preprocess);
    const Stages stages = stages_with(replace, folder_ / "data", observations.lens());
    const Motion motion = estimate_motion(frames, options, stages, progress);
    const fs::path out = folder_ / replace_names()[static_cast<std::size_t>(replace)];
    build_map(frames, motion, options, out, stages, progress);
    return evaluate(folder_ / "data", out, progress);
  }
  static double number(const nlohmann::json& metrics, const char* group, const char* name) {
    return metrics.at(group).at(name).get<double>();
  }

  static fs::path folder_;
};
fs::path WithOracle::folder_;

TEST_F(WithOracle, TrueDepthsAreThoseOfTheLabels) {
  const TrueMotion motion(folder_ / "data");
  std::vector<Vec2> pixels;
  std::vector<Vec3> rays;
  const Lens& lens = motion.truth().camera().lens;
  for (double y = 10.5; y < lens.height; y += 12.0)
    for (double x = 10.5; x < lens.width; x += 12.0) {
      pixels.push_back({x, y});
      const Vec3 ray = *lens.unproject(pixels.back());
      rays.push_back(ray / ray.z());
    }
  const cv::Mat label = motion.truth().depth_mm(3);
  const auto depths = motion.depths_mm(3, rays);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    EXPECT_NEAR(depths[i],
                label.at<float>(static_cast<int>(pixels[i].y()), static_cast<int>(pixels[i].x())),
                1e-4);
}

// What is left of the error when a stage makes none.
TEST_F(WithOracle, ReplacedStagesMakeNoError) {
  const auto ours = metrics_with(Replace::nothing);
  const double ate_mm = number(ours, "trajectory", "ate_sim3_rmse_mm");
  EXPECT_GT(ate_mm, 0.01);  // there is something to be guilty of

  const auto matched = metrics_with(Replace::correspondences);
  constexpr double kExact_mm = 0.005;  // exact tracks: the adjustment ends where the truth is
  EXPECT_TRUE(number(matched, "trajectory", "ate_sim3_rmse_mm") <= kExact_mm)
      << number(matched, "trajectory", "ate_sim3_rmse_mm") << " of " << ate_mm;
  EXPECT_EQ(number(matched, "tracking", "tracked_share"), 1.0);

  const auto placed = metrics_with(Replace::poses);
  constexpr double kSame_mm = 1e-6;
  EXPECT_TRUE(number(placed, "trajectory", "ate_sim3_rmse_mm") <= kSame_mm)
      << number(placed, "trajectory", "ate_sim3_rmse_mm");
  EXPECT_EQ(number(placed, "tracking", "tracked_share"), 1.0);

  // Depth is that of the mosaics: the path is ours, the map nearer to the truth.
  const auto deep = metrics_with(Replace::depth);
  EXPECT_DOUBLE_EQ(number(deep, "trajectory", "ate_sim3_rmse_mm"), ate_mm);
  const auto accuracy = [](const nlohmann::json& m) {
    return m.at("surface").at("icp_aligned").at("accuracy_mean_mm").get<double>();
  };
  EXPECT_TRUE(accuracy(deep) < accuracy(ours)) << accuracy(deep) << " of " << accuracy(ours);
}

TEST(Replaced, CleanFramesAreWithoutWhatSpoilsThem) {
  Variant variant;
  variant.simulate.render.lens.motion_blur = variant.simulate.render.sensor.prnu = true;
  const RenderSettings clean = with_clean_frames(variant).simulate.render;
  EXPECT_FALSE(clean.sensor.noise || clean.sensor.prnu || clean.lens.vignetting ||
               clean.lens.motion_blur || clean.light.highlights);
}

}  // namespace
}  // namespace rugae
