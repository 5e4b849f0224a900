#include "cameras/emitter.h"

#include <gtest/gtest.h>

#include "core/units.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

std::vector<Emitter> lights_of(const std::string& text) {
  YamlReader yaml = YamlReader::from_text(text, "c.yaml");
  std::vector<Emitter> lights = read_lights(yaml);
  yaml.finish();
  return lights;
}

TEST(Emitter, WithoutAListOneIdealLightStandsAtTheCamera) {
  const std::vector<Emitter> lights = lights_of("{}");
  ASSERT_EQ(lights.size(), 1u);
  EXPECT_TRUE(lights[0].central());
  EXPECT_EQ(lights[0].lobe, 0.0);
  EXPECT_EQ(lights[0].intensity, 1.0);
}

TEST(Emitter, WhatIsWrittenReadsBackTheSame) {
  const std::vector<Emitter> lights = lights_of(
      "lights:\n  - {offset_mm: [3.1, -0.7, 0.2], axis: [1, 2, 30], lobe: 2.3}\n"
      "  - {intensity: 0.1}\n");
  EXPECT_NEAR(lights[0].axis.norm(), 1.0, 1e-15);
  EXPECT_FALSE(lights[0].central());
  const std::vector<Emitter> again = lights_of(lights_yaml(lights));
  ASSERT_EQ(again.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again[i].offset_mm, lights[i].offset_mm);
    EXPECT_EQ(again[i].axis, lights[i].axis);
    EXPECT_EQ(again[i].lobe, lights[i].lobe);
    EXPECT_EQ(again[i].intensity, lights[i].intensity);
  }
}

TEST(Emitter, MistakesAreNamedToTheLetter) {
  const auto said = [](const std::string& light) {
    return message_of([&] { lights_of("lights: [" + light + "]"); });
  };
  EXPECT_EQ(said("{axis: [0, 0, 0]}"),
            "c.yaml:1:17: axis is [0, 0, 0], expected a direction other than zero");
  EXPECT_EQ(said("{intensity: -2}"), "c.yaml:1:22: intensity is -2, expected above 0");
  EXPECT_EQ(said("{lobe: -1}"), "c.yaml:1:17: lobe is -1, expected 0 to 100");
  EXPECT_EQ(said("{offset_mm: [0, 0, 200]}"),
            "c.yaml:1:22: offset_mm is [0, 0, 200], expected at most 100 mm from the camera");
  EXPECT_EQ(said("{lobes: 1}"), "c.yaml:1:11: unknown key 'lobes'; did you mean 'lobe'?");
  EXPECT_EQ(said(""), "c.yaml:1:9: lights is empty, expected at least one light");
}

TEST(Emitter, LightsMoveWithTheirCapsule) {
  const Rigid3 to_from_here(Quat(Eigen::AngleAxisd(0.5 * kPi, Vec3::UnitZ())), Vec3(1.0, 2.0, 3.0));
  const std::vector<Emitter> lights =
      moved({{Vec3(2.0, 0.0, 0.0), Vec3::UnitX(), 1.0, 0.5}}, to_from_here);
  EXPECT_TRUE((lights[0].offset_mm - Vec3(1.0, 4.0, 3.0)).norm() <= 1e-12);
  EXPECT_TRUE((lights[0].axis - Vec3::UnitY()).norm() <= 1e-12);
  EXPECT_EQ(lights[0].lobe, 1.0);
}

}  // namespace
}  // namespace rugae
