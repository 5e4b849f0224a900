#include "core/yaml.h"

#include <gtest/gtest.h>

#include "core/units.h"
#include "tests/message_of.h"

namespace rugae {
namespace {

TEST(Yaml, ReadsWhatIsThereAndKeepsDefaults) {
  auto yaml = YamlReader::from_text(
      "tau_px: 20\nname: x\nangle_deg: 90\nlist: [1, 2.5]\nv: [1, 2, 3]\n", "a.yaml");
  double tau = 1.0, absent = 7.0, angle = 0.0;
  std::string name;
  std::vector<double> list;
  Vec3 v;
  yaml.get("tau_px", tau);
  yaml.get("absent", absent);
  yaml.get("name", name);
  yaml.get_deg("angle_deg", angle);
  yaml.get("list", list);
  yaml.get("v", v);
  yaml.finish();
  EXPECT_EQ(tau, 20.0);
  EXPECT_EQ(absent, 7.0);
  EXPECT_EQ(name, "x");
  EXPECT_NEAR(angle, kPi / 2.0, 1e-15);
  EXPECT_EQ(list, (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(v, Vec3(1, 2, 3));
}

TEST(Yaml, UnknownKeyHasLineColumnAndNearestName) {
  auto yaml = YamlReader::from_text("frames: 10\n  \ntrajectroy: 1\n", "s.yaml");
  int frames = 0, trajectory = 0;
  yaml.get("frames", frames);
  yaml.get("trajectory", trajectory);
  EXPECT_EQ(message_of([&] { yaml.finish(); }),
            "s.yaml:3:1: unknown key 'trajectroy'; did you mean 'trajectory'?");
}

TEST(Yaml, UnknownKeyInAChild) {
  auto yaml = YamlReader::from_text("lens:\n  fxx: 3\n", "s.yaml");
  auto lens = yaml.child("lens");
  double fx = 0.0;
  lens->get("fx", fx);
  EXPECT_EQ(message_of([&] { lens->finish(); }),
            "s.yaml:2:3: unknown key 'fxx'; did you mean 'fx'?");
}

TEST(Yaml, WrongTypes) {
  auto yaml = YamlReader::from_text("a: hello\nb: .nan\nc: [1]\nd: 1.5\n", "s.yaml");
  double number = 0.0;
  Vec3 vector;
  int whole = 0;
  EXPECT_EQ(message_of([&] { yaml.get("a", number); }),
            "s.yaml:1:4: a is 'hello', expected a number");
  EXPECT_EQ(message_of([&] { yaml.get("b", number); }),
            "s.yaml:2:4: b is '.nan', expected a finite number");
  EXPECT_EQ(message_of([&] { yaml.get("c", vector); }),
            "s.yaml:3:4: c is a list, expected a list of 3 numbers");
  EXPECT_EQ(message_of([&] { yaml.get("d", whole); }),
            "s.yaml:4:4: d is '1.5', expected a whole number");
}

TEST(Yaml, ChoicesOfferTheNearest) {
  auto yaml = YamlReader::from_text("model: kanala_brandt\n", "s.yaml");
  int choice = 0;
  EXPECT_EQ(message_of([&] {
              yaml.get_choice("model", {"brown_conrady", "kannala_brandt"}, choice);
            }),
            "s.yaml:1:8: model is 'kanala_brandt', expected one of: brown_conrady, kannala_brandt; "
            "did you mean "
            "'kannala_brandt'?");
}

// A value as text goes back into another document, however it was written.
TEST(Yaml, ValuesAsTextAndBack) {
  auto yaml = YamlReader::from_text(
      "a: 1.50\nb: {c: [1, 2], d: {e: true}}\nf:\n  - g: 1\n    h: [x, y]\n  - 7\n", "s.yaml");
  EXPECT_EQ(yaml.text("a"), "1.50");
  EXPECT_EQ(yaml.text("b"), "{c: [1, 2], d: {e: true}}");
  EXPECT_EQ(yaml.text("f"), "[{g: 1, h: [x, y]}, 7]");
  EXPECT_EQ(yaml.text("none"), "");
  EXPECT_EQ(yaml.texts("f"), (std::vector<std::string>{"{g: 1, h: [x, y]}", "7"}));
  auto changed = YamlReader::from_text(
      yaml_with(yaml_with("k: 1\n", "l.m", yaml.text("f")), "k", "no"), "t.yaml");
  EXPECT_EQ(changed.text("k"), "no");
  EXPECT_EQ(changed.text("l"), "{m: [{g: 1, h: [x, y]}, 7]}");
  EXPECT_EQ(message_of([] { yaml_with("k: 1\n", "k.m", "2"); }), "'k' is '1', expected a mapping");
}

TEST(Yaml, MissingTwiceAndBroken) {
  auto yaml = YamlReader::from_text("a: 1\n", "s.yaml");
  int value = 0;
  EXPECT_EQ(message_of([&] { yaml.require("width", value); }),
            "s.yaml:1:1: key 'width' is missing");
  EXPECT_EQ(message_of([] { YamlReader::from_text("a: 1\na: 2\n", "s.yaml"); }),
            "s.yaml:2:1: key 'a' stands twice");
  EXPECT_TRUE(message_of([] {
                YamlReader::from_text("a: [1\n", "s.yaml");
              }).starts_with("s.yaml:2:1: not YAML"));
  EXPECT_EQ(message_of([] { YamlReader::from_text("", "s.yaml"); }),
            "s.yaml:1:1: nothing, expected a mapping of keys to values");
}

}  // namespace
}  // namespace rugae
