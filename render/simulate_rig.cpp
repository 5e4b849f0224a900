// One dataset a camera of a rig, in folders side by side.

#include <algorithm>

#include "cameras/rig.h"
#include "core/check.h"
#include "core/files.h"
#include "core/random.h"
#include "render/simulate.h"

namespace rugae {
namespace {

// How far from the capsule's middle anything of it stands that must not meet the wall.
double reach_mm(const Rig& rig) {
  double reach = 0.0;
  for (const RigCamera& entry : rig.cameras) {
    reach = std::max(reach, entry.capsule_from_camera.translation.norm());
    for (const Emitter& light : entry.camera.lights)
      reach = std::max(reach, (entry.capsule_from_camera * light.offset_mm).norm());
  }
  return reach;
}

// Cameras side by side must not draw the same noise; the first draws that of a camera alone.
std::uint64_t noise_seed(std::uint64_t seed, std::size_t camera) {
  if (camera == 0) return seed;
  const auto words = random_words(seed, Purpose::rig_camera, 0, static_cast<std::uint64_t>(camera));
  return static_cast<std::uint64_t>(words[0]) << 32 | words[1];
}

}  // namespace

SimulateResult simulate_rig(const SimulateOptions& options, const Rig& rig,
                            const std::filesystem::path& out, Progress& progress) {
  make_folder(out);
  const std::filesystem::path description = out / "rig.json";
  const std::string text = rig_json(rig);
  check(!std::filesystem::exists(description) || read_text(description) == text,
        "{}: differs from this run's; choose another folder or remove it", description.string());
  write_atomic(description, text);

  double diameter_mm = 0.0;
  for (const RigCamera& entry : rig.cameras)
    diameter_mm = std::max(diameter_mm, entry.camera.diameter_mm);
  SimulateResult all;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const RigCamera& entry = rig.cameras[i];
    Mount mount{entry.camera, entry.capsule_from_camera, reach_mm(rig), diameter_mm,
                noise_seed(options.seed, i)};
    // The capsule takes all its frames at once: as many as its first camera.
    mount.camera.frames_in_paper = rig.cameras.front().camera.frames_in_paper;
    SimulateOptions of_camera = options;
    of_camera.camera = rig.name + "/" + entry.name;
    const SimulateResult r = simulate_mounted(of_camera, mount, out / entry.name, progress);
    all.frames += r.frames;
    all.skipped += r.skipped;
    all.path_length_mm = r.path_length_mm;
    all.min_clearance_mm = r.min_clearance_mm;
    all.trace_s += r.trace_s;
    all.shade_s += r.shade_s;
    all.label_s += r.label_s;
    all.sensor_s += r.sensor_s;
    all.encode_s += r.encode_s;
    all.write_s += r.write_s;
    all.wall_s += r.wall_s;
  }
  return all;
}

}  // namespace rugae
