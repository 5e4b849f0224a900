#include "cameras/rig.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "tests/message_of.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;

class RigFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("rugae_rig_{}", getpid());
    make_folder(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string write(const std::string& text) const {
    write_atomic(folder_ / "r.yaml", text);
    return (folder_ / "r.yaml").string();
  }
  // The error's text without the folder.
  std::string said(const std::string& cameras) const {
    const std::string file = write("kind: rig\ncameras: [" + cameras + "]\n");
    std::string text = message_of([&] { load_rig(file); });
    for (std::size_t at; (at = text.find(folder_.string() + "/")) != std::string::npos;)
      text.erase(at, folder_.string().size() + 1);
    return text;
  }

  fs::path folder_;
};

TEST(Rig, PresetsHaveRightHandedPoses) {
  const std::vector<std::string> names = preset_names("cameras/rigs");
  EXPECT_EQ(names, (std::vector<std::string>{"front-back", "panoramic", "stereo"}));
  for (const std::string& name : names) {
    EXPECT_TRUE(is_rig(name));
    const Rig rig = load_rig(name);
    EXPECT_GE(rig.cameras.size(), 2u);
    for (const RigCamera& entry : rig.cameras) {
      EXPECT_NEAR(entry.capsule_from_camera.rotation.toRotationMatrix().determinant(), 1.0, 1e-12);
      EXPECT_EQ(entry.camera.lights.size(), rig.cameras.size());
    }
  }
  EXPECT_FALSE(is_rig("misumi-v5506"));
  EXPECT_FALSE(is_rig("no-such-thing"));
}

TEST(Rig, CamerasLookWhereTheirAxesSay) {
  const Rig rig = load_rig("panoramic");
  for (const RigCamera& entry : rig.cameras) {
    const Rigid3& pose = entry.capsule_from_camera;
    // Outwards, with the image's left border towards the capsule's front.
    EXPECT_TRUE((pose.rotation * Vec3::UnitZ() - pose.translation.normalized()).norm() <= 1e-12);
    EXPECT_TRUE((pose.rotation * Vec3::UnitX() + Vec3::UnitZ()).norm() <= 1e-12);
  }
}

// A light stays in one place of the capsule, whichever camera it is described from.
TEST(Rig, EveryCameraIsLitByAllLights) {
  const Rig rig = load_rig("front-back");
  const RigCamera &front = rig.cameras[0], &back = rig.cameras[1];
  ASSERT_EQ(front.camera.lights.size(), 2u);
  EXPECT_TRUE(front.camera.lights[0].central());
  const Emitter& other = front.camera.lights[1];
  EXPECT_TRUE(
      (front.capsule_from_camera * other.offset_mm - back.capsule_from_camera.translation).norm() <=
      1e-12);
  EXPECT_TRUE((front.capsule_from_camera.rotation * other.axis + Vec3::UnitZ()).norm() <= 1e-12);
}

TEST_F(RigFile, MistakesAreNamedToTheLetter) {
  EXPECT_EQ(said(""), "r.yaml:2:10: cameras is empty, expected at least one camera");
  EXPECT_TRUE(said("{name: a, camera: misumi-v550}")
                  .starts_with("r.yaml:2:29: camera 'misumi-v550': no such preset; did you mean "
                               "'misumi-v5506'?"))
      << said("{name: a, camera: misumi-v550}");
  EXPECT_EQ(said("{name: a/b, camera: misumi-v5506}"),
            "r.yaml:2:18: name 'a/b' is not fit for a folder, expected letters, digits, '-', '_' "
            "and '.'");
  EXPECT_EQ(said("{name: a, camera: misumi-v5506}, {name: a, camera: misumi-v5506}"),
            "r.yaml:2:10: the name 'a' stands twice, expected a name of its own for each camera");
  EXPECT_EQ(said("{name: a, camera: misumi-v5506, forward: [0, 0, 0]}"),
            "r.yaml:2:52: forward is [0, 0, 0], expected a direction other than zero");
  EXPECT_EQ(said("{name: a, camera: misumi-v5506, right: [0, 0, 1]}"),
            "r.yaml:2:50: right is not perpendicular to forward (cosine 1, expected at most "
            "1e-06)");
  EXPECT_EQ(said("{name: a, camera: misumi-v5506}, {name: b, camera: awaiba-naneye}"),
            "r.yaml:2:10: camera 'b' takes 44 frames a second and 'a' 30, expected the same for "
            "all");
}

TEST_F(RigFile, TheJsonHasThePoses) {
  const Rig rig = load_rig("stereo");
  const auto json = nlohmann::json::parse(rig_json(rig));
  EXPECT_EQ(json["name"], "stereo");
  EXPECT_EQ(json["cameras"][1]["name"], "right");
  EXPECT_EQ(json["cameras"][1]["capsule_from_camera"]["translation_mm"][0], 2.0);
  EXPECT_EQ(json["cameras"][1]["capsule_from_camera"]["rotation_xyzw"][3], 1.0);
}

}  // namespace
}  // namespace rugae
