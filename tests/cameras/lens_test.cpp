#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "cameras/camera.h"
#include "core/files.h"
#include "core/presets.h"
#include "core/units.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

constexpr double kRoundTrip_px = 1e-9;

void expect_round_trip(const Lens& lens) {
  const LensProjector fast(lens);
  for (int v = 0; v <= 2 * lens.height; ++v)
    for (int u = 0; u <= 2 * lens.width; ++u) {
      const Vec2 pixel(0.5 * u, 0.5 * v);
      const auto ray = fast.unproject(pixel);
      ASSERT_TRUE(ray) << pixel.transpose();
      EXPECT_NEAR(ray->norm(), 1.0, 1e-14);
      const auto back = fast.project(*ray);
      ASSERT_TRUE(back) << pixel.transpose();
      ASSERT_TRUE((*back - pixel).norm() <= kRoundTrip_px)
          << pixel.transpose() << " -> " << back->transpose();
    }
}

TEST(Lens, RoundTripOverTheWholeImageOfEveryPreset) {
  for (const std::string& name : preset_names("cameras")) expect_round_trip(load_camera(name).lens);
}

TEST(Lens, RoundTripOfAFisheyeBeyondNinetyDegrees) {
  Lens lens;
  lens.model = LensModel::kannala_brandt;
  lens.width = lens.height = 320;
  lens.fx = lens.fy = 120.0;
  lens.cx = 161.0;
  lens.cy = 158.5;
  lens.k1 = -0.02;
  lens.k2 = 0.004;
  lens.k3 = -0.0015;
  lens.k4 = 0.0001;
  ASSERT_TRUE(deg_from_rad(std::acos(lens.unproject(Vec2(0, 0))->z())) > 90.0);
  expect_round_trip(lens);
}

// Values by hand: r^2 = 0.05, radial = 1 - 0.2 * 0.05 + 0.03 * 0.0025 = 0.990075,
// x = 0.1 * 0.990075 + 2 p1 0.02 + p2 (0.05 + 0.02), y = 0.2 * 0.990075 + p1 (0.05 + 0.08) + 2 p2
// 0.02.
TEST(Lens, BrownConradyByHand) {
  Lens lens;
  lens.width = 640;
  lens.height = 480;
  lens.fx = 300.0;
  lens.fy = 200.0;
  lens.cx = 320.0;
  lens.cy = 240.0;
  lens.k1 = -0.2;
  lens.k2 = 0.03;
  lens.p1 = 0.001;
  lens.p2 = -0.002;
  const auto pixel = lens.project(Vec3(1.0, 2.0, 10.0));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 320.0 + 300.0 * (0.0990075 + 0.00004 - 0.00014), 1e-12 * 640);
  EXPECT_NEAR(pixel->y(), 240.0 + 200.0 * (0.198015 + 0.00013 - 0.00008), 1e-12 * 640);
}

// theta = pi/4 at equal x and z: theta_d = theta (1 + k1 theta^2).
TEST(Lens, KannalaBrandtByHand) {
  Lens lens;
  lens.model = LensModel::kannala_brandt;
  lens.width = lens.height = 400;
  lens.fx = lens.fy = 100.0;
  lens.cx = lens.cy = 200.0;
  lens.k1 = 0.1;
  const auto pixel = lens.project(Vec3(5.0, 0.0, 5.0));
  ASSERT_TRUE(pixel);
  const double theta = kPi / 4.0;
  EXPECT_NEAR(pixel->x(), 200.0 + 100.0 * theta * (1.0 + 0.1 * theta * theta), 1e-10);
  EXPECT_NEAR(pixel->y(), 200.0, 1e-10);
}

TEST(Lens, SeesNothingBehindOrBeyondItsTurningPoint) {
  const Lens lens = load_camera("misumi-v5506").lens;
  EXPECT_FALSE(lens.project(Vec3(0, 0, -1)));
  EXPECT_FALSE(lens.project(Vec3(1, 0, 0)));
  EXPECT_FALSE(lens.project(Vec3::Zero()));
  EXPECT_FALSE(lens.project(Vec3(std::nan(""), 0, 1)));
  Lens folding = lens;  // k1 alone folds back where 1 + 3 k1 r^2 = 0
  folding.k1 = -0.3;
  folding.k2 = folding.p1 = folding.p2 = 0.0;
  EXPECT_NEAR(std::tan(folding.max_angle_rad()), std::sqrt(1.0 / 0.9), 1e-9);
  EXPECT_FALSE(folding.project(Vec3(1.2, 0, 1)));
  EXPECT_FALSE(folding.unproject(Vec2(1e6, 0)));
}

TEST(Camera, PresetsHaveThePapersNumbers) {
  const Camera naneye = load_camera("awaiba-naneye"), one = load_camera("misumi-v3506"),
               two = load_camera("misumi-v5506"), potensic = load_camera("potensic-mini");
  EXPECT_EQ(naneye.lens.width, 250);
  EXPECT_EQ(one.lens.height, 400);
  EXPECT_EQ(two.lens.width, 640);
  EXPECT_EQ(potensic.lens.height, 720);
  EXPECT_EQ(naneye.sensor.fps, 44.0);
  EXPECT_EQ(naneye.sensor.shutter, Shutter::rolling);
  EXPECT_EQ(two.sensor.pixel_pitch_um, 6.0);
  EXPECT_EQ(potensic.sensor.bit_depth, 10);
}

TEST(Camera, TheFullMatrixHas17010Frames) {
  int total = 0;
  for (const std::string& name : preset_names("cameras")) {
    const Camera camera = load_camera(name);
    int sum = 0;
    for (int t = 1; t <= 6; ++t) sum += frames_of_trajectory(camera, t);
    EXPECT_EQ(sum, camera.frames_in_paper);
    total += sum;
  }
  EXPECT_EQ(total, 17010);
}

TEST(Camera, FieldOfViewIsWhatThePresetSays) {
  for (const auto& [name, fov_deg] : {std::pair{"awaiba-naneye", 90.0},
                                      {"misumi-v3506", 100.0},
                                      {"misumi-v5506", 100.0},
                                      {"potensic-mini", 100.0}}) {
    const Lens lens = load_camera(name).lens;
    const Vec3 left = *lens.unproject(Vec2(0.0, lens.cy)),
               right = *lens.unproject(Vec2(lens.width, lens.cy));
    const double decentring_deg = 0.2;  // p1 and p2 tilt the borders a little
    EXPECT_NEAR(deg_from_rad(std::acos(left.dot(right))), fov_deg, decentring_deg);
  }
}

TEST(Camera, YamlRoundTrip) {
  const auto file = std::filesystem::temp_directory_path() / "rugae_camera_round_trip.yaml";
  const Camera camera = load_camera("misumi-v5506");
  write_atomic(file, camera_yaml(camera));
  const Camera back = load_camera(file.string());
  EXPECT_EQ(camera_yaml(back), camera_yaml(camera));
  EXPECT_EQ(back.lens.fx, camera.lens.fx);
  write_atomic(file, lens_yaml(camera.lens, "test"));
  EXPECT_EQ(load_lens(file).k1, camera.lens.k1);
  std::filesystem::remove(file);
}

TEST(Camera, ErrorsNameThePlace) {
  const auto file = std::filesystem::temp_directory_path() / "rugae_camera_errors.yaml";
  const std::string good = camera_yaml(load_camera("misumi-v5506"));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    write_atomic(file, text);
    return message_of([&] { load_camera(file.string()); });
  };
  EXPECT_EQ(with("bit_depth: 10", "bit_depth: 40"),
            file.string() + ":25:14: bit_depth is 40, expected 8 to 16");
  EXPECT_EQ(with("  width: 640", "  widht: 640"),
            file.string() + ":6:3: unknown key 'widht'; did you mean 'width'?");
  EXPECT_EQ(with("prnu: 0.01", "prnu: -1 #"),
            file.string() + ":29:9: prnu is -1, expected 0 to 0.2");
  EXPECT_EQ(with("dsnu_e: 3", "dsnu_e: -3"),
            file.string() + ":30:11: dsnu_e is -3, expected 0 to the full well's 18000");
  EXPECT_EQ(with("black_level: 0", "black_level: 513"),
            file.string() + ":31:16: black_level is 513, expected 0 to 512");
  EXPECT_EQ(with("  k1: -0.2", "  k1: -2.0 #"),
            file.string() + ":5:3: the distortion has no inverse at the image corner (0, 0)");
  EXPECT_EQ(with("  shutter: global", "  shutter: global\n  row_time_us: 20"),
            file.string() + ":29:16: row_time_us is given, but the shutter is global");
  EXPECT_EQ(with("  shutter: global", "  shutter: rolling\n  row_time_us: 90"),
            file.string() +
                ":29:16: row_time_us is 90, expected above 0 and at most 69.4444 (480 "
                "rows at 30 frames a second)");
  EXPECT_EQ(with("  f_number: 5", "  f_number: 0"),
            file.string() + ":33:13: f_number is 0, expected 0.5 to 100");
  std::filesystem::remove(file);
}

TEST(Camera, ARollingShutterReadsWithinTheFrame) {
  const Camera naneye = load_camera("awaiba-naneye");
  EXPECT_EQ(naneye.sensor.row_time_us, 90.0);
  EXPECT_EQ(load_camera("misumi-v5506").sensor.row_time_us, 0.0);
  const auto file = std::filesystem::temp_directory_path() / "rugae_camera_rolling.yaml";
  const std::string text = camera_yaml(naneye);
  write_atomic(file, text);
  EXPECT_EQ(camera_yaml(load_camera(file.string())), text);
  // Where a file does not say, reading takes the whole of the frame's time.
  const std::size_t line = text.find("  row_time_us");
  write_atomic(file, text.substr(0, line) + text.substr(text.find('\n', line) + 1));
  EXPECT_DOUBLE_EQ(load_camera(file.string()).sensor.row_time_us, 1e6 / (44.0 * 250.0));
  std::filesystem::remove(file);
}

TEST(Camera, TheApertureIsTheFocalLengthOverTheFNumber) {
  Camera camera = load_camera("misumi-v5506");
  camera.lens.fx = 250.0;
  camera.sensor.pixel_pitch_um = 6.0;  // 1.5 mm of focal length
  camera.focus.f_number = 5.0;
  EXPECT_DOUBLE_EQ(aperture_radius_mm(camera), 0.15);
  camera.focus = {};
  EXPECT_EQ(aperture_radius_mm(camera), 0.0);
}

TEST(Vignetting, CosineFourthAndPolynomial) {
  Lens lens;
  lens.width = 200;
  lens.height = 200;
  lens.fx = lens.fy = 100.0;
  lens.cx = lens.cy = 100.0;
  EXPECT_NEAR(vignette_at({}, lens, Vec2(200.0, 100.0)), 0.25, 1e-12);  // 45 degrees: cos^4 = 1/4
  EXPECT_NEAR(vignette_at({}, lens, Vec2(100.0, 100.0)), 1.0, 1e-15);
  // r^2 = 100^2 / (100 sqrt 2)^2 = 1/2
  EXPECT_NEAR(vignette_at({false, -0.2, 0.1, -0.08}, lens, Vec2(200.0, 100.0)),
              1.0 - 0.1 + 0.025 - 0.01, 1e-12);
}

}  // namespace
}  // namespace rugae
