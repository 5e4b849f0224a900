#include "render/settings.h"

#include <gtest/gtest.h>

#include "core/check.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

TEST(Settings, AFileAndChangesKeepWhatTheyDoNotName) {
  RenderSettings settings;
  read_settings(YamlReader::from_text("lens: {vignetting: false}\n", "s.yaml"), settings);
  change_setting("sensor.noise=false", settings);
  EXPECT_FALSE(settings.lens.vignetting);
  EXPECT_FALSE(settings.sensor.noise);
  EXPECT_TRUE(settings.labels);
  change_setting("lens.vignetting=true", settings);
  EXPECT_TRUE(settings.lens.vignetting);
  EXPECT_FALSE(settings.sensor.noise);
}

TEST(Settings, MistakesAreNamed) {
  RenderSettings settings;
  const auto change = [&](const std::string& text) {
    return message_of([&] { change_setting(text, settings); });
  };
  EXPECT_EQ(change("noise"), "'noise' is not a setting, expected path=value");
  EXPECT_NE(change("sensor.nose=true").find("did you mean 'noise'?"), std::string::npos)
      << change("sensor.nose=true");
  EXPECT_NE(change("sensor.noise=much").find("sensor.noise=much"), std::string::npos)
      << change("sensor.noise=much");
}

TEST(Settings, MistakesOfTheSensorAreNamedToTheLetter) {
  const auto change = [](const std::string& text) {
    RenderSettings fresh;
    return message_of([&] { change_setting(text, fresh); });
  };
  EXPECT_EQ(change("sensor.bayer=rgbg"),
            "sensor.bayer=rgbg:1:18: bayer is 'rgbg', expected one of: none, rggb, bggr, grbg, "
            "gbrg; did you mean 'rggb'?");
  EXPECT_EQ(change("output.jpeg_quality=0"),
            "output.jpeg_quality=0:1:25: jpeg_quality is 0, expected 1 to 100");
  EXPECT_EQ(change("sensor.delay_frames=-1"),
            "sensor.delay_frames=-1:1:25: delay_frames is -1, expected 0 to 100");
  EXPECT_EQ(change("sensor.smoothing=1"),
            "sensor.smoothing=1:1:22: smoothing is 1, expected 0 to 0.99");
  EXPECT_EQ(change("sensor.prnu=-1"), "sensor.prnu=-1:1:17: prnu is '-1', expected true or false");
  EXPECT_EQ(change("output.frames=jpg"),
            "output.frames=jpg:1:19: frames is 'jpg', expected one of: png, jpeg; did you mean "
            "'jpeg'?");
  RenderSettings settings;
  settings.output.mosaic = true;
  EXPECT_EQ(message_of([&] { settings.check(); }),
            "render.output: mosaic is true, but render.sensor.bayer is none");
}

TEST(Settings, MistakesOfTheLightAreNamedToTheLetter) {
  const auto change = [](const std::string& text) {
    RenderSettings fresh;
    return message_of([&] { change_setting(text, fresh); });
  };
  EXPECT_EQ(change("light.bounces=-1"), "light.bounces=-1:1:19: bounces is -1, expected 0 to 255");
  EXPECT_EQ(change("light.samples=0"), "light.samples=0:1:19: samples is 0, expected 1 to 65535");
  EXPECT_EQ(change("light.bounce=2"),
            "light.bounce=2:1:10: unknown key 'bounce'; did you mean 'bounces'?");
}

TEST(Settings, SamplesBlurAndLabels) {
  RenderSettings settings;
  const auto change = [&](const std::string& text) {
    RenderSettings broken;
    return message_of([&] { change_setting(text, broken); });
  };
  EXPECT_EQ(change("lens.samples=0"), "lens.samples=0:1:18: samples is 0, expected 1 to 4095");
  EXPECT_NE(change("truth.triangle=true").find("did you mean 'triangles'?"), std::string::npos);
  change_setting("lens.motion_blur=true", settings);
  EXPECT_EQ(message_of([&] { settings.check(); }),
            "render.lens: motion_blur with samples 1 would be noise alone, expected samples of at "
            "least 2");
  change_setting("lens.samples=2", settings);
  change_setting("lens.defocus=true", settings);
  change_setting("truth.backward_flow=true", settings);
  settings.check();
  EXPECT_TRUE(settings.lens.rolling_shutter);
  EXPECT_TRUE(settings.truth.labels.backward_flow);
  EXPECT_FALSE(settings.truth.labels.triangles);
}

}  // namespace
}  // namespace rugae
