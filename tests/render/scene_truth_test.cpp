// What a dataset keeps of its scene.

#include "render/scene_truth.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/files.h"
#include "render/simulate.h"
#include "tests/message_of.h"

namespace rugae {
namespace {
namespace fs = std::filesystem;

class SceneTruth : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) /
            ("rugae_scene_truth_" + std::to_string(static_cast<long>(getpid())));
    fs::remove_all(root_);
    make_folder(root_);
    write_scene("{uniform: [0.3, 0.8]}");
    write_atomic(root_ / "camera.yaml",
                 "name: small\nframes_in_paper: 6\ndiameter_mm: 4\n"
                 "lens: {model: brown_conrady, width: 32, height: 24, horizontal_fov_deg: 90}\n"
                 "vignetting: {cos4: true}\n"
                 "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 9000, "
                 "read_noise_e: 5, shutter: global}\n");
    // two poses in the middle of the body
    write_atomic(root_ / "track.txt", "0 30 0 -20 0 0 0 1\n0.033 31 0 -20 0 0 0 1\n");
    write_atomic(root_ / "path.yaml", "file: track.txt\nclearance_mm: 5\n");
  }
  void TearDown() override { fs::remove_all(root_); }

  void write_scene(const std::string& wetness) {
    write_atomic(root_ / "scene.yaml",
                 "mucosa: {wetness: " + wetness + "}\nlesions: {polyp: 2, ulcer: 1}\n");
  }
  void run(const std::string& folder) {
    SimulateOptions options;
    options.scene = (root_ / "scene.yaml").string();
    options.camera = (root_ / "camera.yaml").string();
    options.trajectory = (root_ / "path.yaml").string();
    options.resolution = "coarse";
    options.render.labels = false;
    Progress progress(Progress::Output::silent);
    simulate(options, root_ / folder, progress);
  }

  fs::path root_;
};

TEST_F(SceneTruth, KeepsTheDrawsAndTheInstances) {
  run("a");
  const fs::path file = root_ / "a/truth/scene.yaml";
  const Scene scene = load_scene({(root_ / "scene.yaml").string(), 1, "coarse"});
  const Scene again = load_scene({file.string(), 1, "coarse"});
  EXPECT_EQ(again.resolved_yaml, scene.resolved_yaml);
  EXPECT_EQ(again.wall.vertices, scene.wall.vertices);
  const std::string text = read_text(root_ / "a/truth/instances.csv");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4);
  EXPECT_NE(text.find("\n3,ulcer,"), std::string::npos);
}

TEST_F(SceneTruth, AnEditedSceneIsAnotherDataset) {
  run("a");
  run("a");  // the same again is fine
  write_scene("0.55");
  const std::string message = message_of([&] { run("a"); });
  EXPECT_NE(message.find("holds another dataset (options: scene_yaml is "), std::string::npos)
      << message;
}

}  // namespace
}  // namespace rugae
