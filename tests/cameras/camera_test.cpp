// Camera files: what is written reads back, what cannot be is refused.

#include "cameras/camera.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "core/check.h"
#include "core/files.h"
#include "tests/message_of.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;

class CameraFile : public ::testing::Test {
 protected:
  void SetUp() override { make_folder(root_); }
  void TearDown() override { fs::remove_all(root_); }
  Camera read(const std::string& text) const {
    write_atomic(root_ / "camera.yaml", text);
    return load_camera((root_ / "camera.yaml").string());
  }

  static constexpr const char* kSensor =
      "sensor: {pixel_pitch_um: 6, fps: 30, bit_depth: 10, full_well_e: 18000, read_noise_e: 10}\n";
  static constexpr const char* kLens = "lens: {width: 64, height: 48, horizontal_fov_deg: 100}\n";
  fs::path root_ = fs::temp_directory_path() / fmt::format("rugae_camera_{}", getpid());
};

TEST_F(CameraFile, NamesReadBackWhateverTheyAre) {
  for (const std::string name :
       {"misumi-v5506", "Misumi: left", "#3", "[a]", "null", "", "a \"b\"", "50 %"}) {
    Camera camera = read(std::string(kLens) + kSensor);
    camera.name = name;
    EXPECT_EQ(read(camera_yaml(camera)).name, name);
  }
  EXPECT_EQ(message_of([&] { read(std::string("name: \"a\\nb\"\n") + kLens + kSensor); }),
            (root_ / "camera.yaml").string() +
                ":1:7: name has a line break or another control character");
}

TEST_F(CameraFile, FallOffIsAboveZeroAllOver) {
  const auto refused = [&](const std::string& text) {
    return message_of([&] { read(text + kSensor); });
  };
  // 1 in the middle and at the corner, below 0 between them.
  EXPECT_NE(refused(std::string(kLens) + "vignetting: {v1: -5, v2: 5}\n").find("expected above 0"),
            std::string::npos);
  EXPECT_NE(
      refused(std::string(kLens) + "vignetting: {v1: -2}\n").find("no light at the image corner"),
      std::string::npos);
}

// Natural fall-off ends at 90 degrees: an even power would rise again behind.
TEST_F(CameraFile, NoLightComesFromBehind) {
  const std::string fisheye =
      "lens: {model: kannala_brandt, width: 64, height: 64, horizontal_fov_deg: 200}\n";
  const Camera natural = read(fisheye + kSensor);
  const Camera even = read(fisheye + kSensor + "vignetting: {cos4: false}\n");
  const Vec2 ahead(32.0, 30.0), behind(1.0, 1.0);
  EXPECT_GT(vignette_at(natural.vignetting, natural.lens, ahead), 0.9);
  EXPECT_EQ(vignette_at(natural.vignetting, natural.lens, behind), 0.0);
  EXPECT_EQ(vignette_at(even.vignetting, even.lens, behind), 1.0);
}

}  // namespace
}  // namespace rugae
