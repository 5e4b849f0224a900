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

}  // namespace
}  // namespace rugae
