// Whatever settings are within their ranges make a sound dataset; whatever are not are refused with
// the place named. The settings come from the list that the reader goes by, so new ones are
// covered.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <opencv2/core.hpp>

#include "core/files.h"
#include "core/mesh_io.h"
#include "core/pose_track.h"
#include "dataset/check_dataset.h"
#include "dataset/image_io.h"
#include "dataset/layout.h"
#include "render/simulate.h"
#include "tests/properties.h"
#include "tests/render/walls.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;
using test::flip;
using test::one_of;

std::string text_of_valid_settings() {
  return test::mapping_of(list_settings(),
                          [](const Field& f) { return flip() ? test::value_of(f) : ""; });
}

RenderSettings settings_of(const std::string& text) {
  RenderSettings settings;
  read_settings(YamlReader::from_text(text, "s.yaml"), settings);
  return settings;
}

// The rules that hold between settings.
void reconcile(RenderSettings& s) {
  if (s.sensor.bayer == Bayer::none) s.output.mosaic = false;
  if (s.lens.motion_blur || s.lens.defocus) s.lens.samples = std::max(2, s.lens.samples);
  if (s.truth.coverage) s.truth.labels.triangles = true;
  if (s.light.bounces == 0) s.truth.labels.indirect = false;
}

TEST(SettingsProperty, WithinTheirRangesTheyAreReadAndKept) {
  test::for_cases(300, [] {
    const std::string text = text_of_valid_settings();
    RenderSettings settings = settings_of(text);
    const std::string json = settings_json(settings);
    RC_ASSERT(settings_json(settings_of(json)) == json);
    reconcile(settings);
    settings.check();
  });
}

TEST(SettingsProperty, OneWrongValueIsRefusedWithItsPlace) {
  test::for_cases(1000, [] {
    const std::vector<Field> all = list_settings();
    const Field wrong = one_of(all);
    const std::string bad = test::wrong_value_of(wrong);
    const std::string text = test::mapping_of(all, [&](const Field& f) -> std::string {
      if (f.path == wrong.path) return bad;
      return flip() ? test::value_of(f) : "";
    });
    RC_LOG(text);
    std::string message;
    const bool refused = test::refuses([&] { settings_of(text); }, "s.yaml:1:", message);
    RC_LOG(message);
    RC_ASSERT(refused);
    const std::string change = wrong.path + "=" + bad;
    RenderSettings settings;
    RC_ASSERT(test::refuses([&] { change_setting(change, settings); }, change, message));
  });
}

TEST(SettingsProperty, BrokenStructureIsRefusedWithItsPlace) {
  test::for_cases(1000, [] {
    test::Breaker breaker(text_of_valid_settings());
    const std::string text = breaker.broken();
    RC_LOG(text);
    std::string message;
    const bool refused = test::refuses([&] { settings_of(text); }, "s.yaml:1:", message);
    RC_LOG(message);
    RC_ASSERT(refused);
  });
}

TEST(SettingsProperty, JunkIsRefusedOrHarmless) {
  test::for_cases(2000, [] {
    const std::string text = test::junk(text_of_valid_settings());
    std::string message;
    const bool refused = test::refuses([&] { settings_of(text); }, "s.yaml:", message);
    RC_LOG(text.substr(0, 200));
    RC_LOG(message);
    RC_ASSERT(refused || message == "accepted");
    RenderSettings settings;
    RC_ASSERT(test::refuses([&] { change_setting(text, settings); }, "", message) ||
              message == "accepted");
  });
}

class SettingsRender : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(root_);
    make_folder(root_);
    write_ply(root_ / "wall.ply", test::sphere_mesh(3, 40.0, [](const Vec3& d) {
                return 1.0 + 0.1 * std::sin(5.0 * d.x()) * std::cos(4.0 * d.y());
              }));
    write_atomic(root_ / "scene.yaml",
                 "{kind: mesh, mesh: wall.ply, target_edge_mm: 6, with_relief: false}\n");
    write_atomic(root_ / "camera.yaml",
                 "{lens: {width: 32, height: 24, horizontal_fov_deg: 90}, "
                 "focus: {f_number: 4, distance_mm: 20}, "
                 "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 9000, "
                 "read_noise_e: 5, prnu: 0.01, dsnu_e: 3, shutter: rolling}}\n");
    PoseTrack track;
    for (int i = 0; i < 3; ++i)
      track.push_back({i / 30.0, Rigid3(Quat(Eigen::AngleAxisd(0.05 * i, Vec3::UnitY())),
                                        Vec3(2.0 * i, -0.7 * i, 1.5 * i))});
    write_atomic(root_ / "track.txt", tum_text(track));
    write_atomic(root_ / "path.yaml", "{file: track.txt, clearance_mm: 5}\n");
    options_.scene = (root_ / "scene.yaml").string();
    options_.camera = (root_ / "camera.yaml").string();
    options_.trajectory = (root_ / "path.yaml").string();
    options_.resolution = "coarse";
    options_.frames = 3;
  }
  void TearDown() override { fs::remove_all(root_); }

  fs::path root_ = fs::temp_directory_path() / fmt::format("rugae_settings_{}", getpid());
  SimulateOptions options_;
};

TEST_F(SettingsRender, WhateverIsWithinItsRangeMakesASoundDataset) {
  test::for_cases(12, [&] {
    RenderSettings& s = options_.render;
    s = settings_of(text_of_valid_settings());
    reconcile(s);
    // what costs time alone
    s.lens.samples = std::min(s.lens.samples, 3);
    s.light.bounces = std::min(s.light.bounces, 3);
    s.light.samples = std::min(s.light.samples, 2);
    s.truth.tracks = std::min(s.truth.tracks, 50);
    // longer than a frame of this camera takes
    s.sensor.exposure_time_s = std::min(s.sensor.exposure_time_s, 1.0 / 30.0);
    RC_LOG(settings_json(s));
    const fs::path out = root_ / "out";
    fs::remove_all(out);
    Progress progress(Progress::Output::silent);
    simulate(options_, out, progress);
    const DatasetCheck check = check_dataset(out);
    for (const std::string& problem : check.problems) RC_LOG(problem);
    RC_ASSERT(check.problems.empty());
    RC_ASSERT(check.frames == 3);
    const DatasetLayout layout{out};
    if (s.output.radiance) {
      const cv::Mat radiance = read_any_exr(layout.truth() / "radiance" / "000001.exr");
      RC_ASSERT(cv::checkRange(radiance, true, nullptr, 0.0, 1e30));
      RC_ASSERT(cv::sum(radiance)[1] > 0.0);
    }
    if (s.wanted_labels().depth) {  // a closed wall: every pixel sees it
      const cv::Mat depth = read_any_exr(layout.truth() / "depth" / "000001.exr");
      RC_ASSERT(cv::checkRange(depth, true, nullptr, 1e-3, 1e3));
    }
  });
}

}  // namespace
}  // namespace rugae
