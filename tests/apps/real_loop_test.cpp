// The whole loop on a real anatomical stomach (BodyParts3D FMA7148): frames, reconstruction,
// errors, page.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "tests/shared_data.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

TEST(RealDataLoop, TheAnatomicalStomach) {
  const fs::path mesh = shared_data() / "meshes/stomach_bodyparts3d_FMA7148.ply";
  if (!fs::exists(mesh)) GTEST_SKIP() << mesh << " is not there";
  const fs::path folder = fs::temp_directory_path() / "rugae_real_loop";
  fs::remove_all(folder);
  fs::create_directories(folder);
  std::ofstream(folder / "short.yaml") << "like: '1'\npaper_number: 0\nlength_cm: 12\npasses: 1\n";
  std::ofstream(folder / "study.yaml")
      << "title: a real stomach\nscene: " << fs::canonical(mesh).string()
      << "\nresolution: coarse\nframes: 60\ncameras: [misumi-v3506]\n"
         "trajectories: [short.yaml]\nmethods: [paper]\n";
  const std::string command =
      "cd '" + folder.string() + "' && '" + RUGAE_PROGRAM + "' run study.yaml --out out";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_TRUE(fs::exists(folder / "out/report.html"));

  const auto results = nlohmann::json::parse(read_text(folder / "out/results.json"));
  const auto& metrics = results.at("cells").at(0).at("metrics");
  // Nearly all frames are near the next one here; a lost tenth would say that tracking broke.
  EXPECT_GE(metrics.at("tracking").at("tracked_share").get<double>(), 0.9);
  // The paper's best figure over ten times this path, per length: 4.10 cm of 123.5 cm.
  constexpr double kPapersShare = 4.10 / 123.5;
  EXPECT_LE(metrics.at("trajectory").at("ate_sim3_rmse_mm").get<double>(), kPapersShare * 120.0);
  EXPECT_TRUE(metrics.at("surface").at("trajectory_aligned").at("accuracy_mean_mm").is_number());
  fs::remove_all(folder);
}

}  // namespace
}  // namespace rugae
