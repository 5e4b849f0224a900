// Simulates a small dataset: the program that another compiler builds, or another processor runs,
// and whose bytes must be the same (scripts/compare_compilers.sh, scripts/compare_processors.sh).

#include <cstdio>
#include <filesystem>

#include "core/check.h"
#include "core/files.h"
#include "core/mesh_io.h"
#include "core/progress.h"
#include "render/simulate.h"
#include "scenes/scene.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSensor =
    "sensor: {pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: 8000, read_noise_e: 10}\n";
constexpr const char* kFisheye =
    "lens: {model: kannala_brandt, width: 160, height: 120, horizontal_fov_deg: 150,\n"
    "  k1: -0.02, k2: 0.004, k3: -0.0015, k4: 0.0001}\n";
constexpr const char* kBarrel =
    "lens: {width: 160, height: 120, horizontal_fov_deg: 110, k1: -0.2, k2: 0.05, k3: -0.005,\n"
    "  p1: 0.002, p2: -0.001}\n";

std::string camera_file(const fs::path& folder, const std::string& lens) {
  write_atomic(folder / "camera.yaml", lens + kSensor);
  return (folder / "camera.yaml").string();
}

// A wall as other programs write it: triangles alone.
std::string mesh_file(const fs::path& folder) {
  TriangleMesh wall = load_scene({.seed = 3, .resolution = "coarse"}).wall;
  wall.normals.clear();
  write_ply(folder / "wall.ply", wall);
  return (folder / "wall.ply").string();
}

// Every kind of path, lens and wall whose arithmetic the bytes depend on is in one of them. Input
// files stand beside OUT, since their place is part of the dataset.
SimulateOptions options_of(const std::string& name, const fs::path& inputs) {
  SimulateOptions options;
  options.resolution = "coarse";
  options.camera = "awaiba-naneye";
  options.frames = 12;
  if (name == "loops") {
    options.trajectory = "1";
  } else if (name == "oil") {
    options.trajectory = "6";
  } else if (name == "fisheye") {
    options.trajectory = "4";
    options.camera = camera_file(inputs, kFisheye);
  } else if (name == "imported") {
    options.trajectory = "3";
    options.camera = camera_file(inputs, kBarrel);
    options.scene = mesh_file(inputs);
  } else {
    fail("no case '{}'", name);
  }
  return options;
}

}  // namespace
}  // namespace rugae

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: same_bytes loops|oil|fisheye|imported OUT\n");
    return 2;
  }
  try {
    const std::filesystem::path out = argv[2], inputs = out.parent_path() / "inputs";
    rugae::make_folder(inputs);
    rugae::Progress progress;
    rugae::simulate(rugae::options_of(argv[1], inputs), out, progress);
    return 0;
  } catch (const rugae::Error& error) {
    std::fprintf(stderr, "same_bytes: %s\n", error.what());
    return 1;
  }
}
