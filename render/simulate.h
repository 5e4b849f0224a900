#pragma once
// The loop over frames: scene, camera and trajectory in, dataset out.

#include <cstdint>
#include <filesystem>
#include <string>

#include "cameras/rig.h"
#include "core/progress.h"
#include "render/settings.h"

namespace rugae {

struct SimulateOptions {
  std::string scene = "stomach";        // preset, YAML or mesh file
  std::string camera = "misumi-v5506";  // preset or YAML, of a camera or of a rig
  std::string trajectory = "1";         // preset or YAML
  std::string resolution = "medium";
  int frames = 0;       // 0: as many as in the paper for this camera and trajectory, or in the file
  int first = 0;        // only the first so many of these, at the same pace; 0: all
  int only_frame = -1;  // replays a single frame
  std::uint64_t seed = 1;
  int threads = 0;  // 0: all
  RenderSettings render;
  /// For the ray tracing library, such as "isa=avx2" to restrict its instruction set. No result
  /// depends on it, so it stands in no file and no command line.
  std::string ray_device;
  /// Throws Error naming the field.
  void check() const;
};

struct SimulateResult {
  int frames = 0, skipped = 0;  // skipped: found finished from an earlier run
  double path_length_mm = 0.0, min_clearance_mm = 0.0;  // to the wall at rest
  // Processor seconds of all threads over the frame loop. Writing is what the system spends while
  // files are written; encoding the rest of that stage.
  double trace_s = 0.0, shade_s = 0.0, label_s = 0.0, sensor_s = 0.0, encode_s = 0.0, write_s = 0.0;
  double wall_s = 0.0;  // of the frame loop, by the clock
};

/// Writes the dataset to `out`; goes on where an earlier run of the same options was stopped. The
/// same options write the same bytes, whatever the threads. Memory holds two frames a thread,
/// however many there are. With `only_frame` the folder receives that frame alone and never becomes
/// a complete dataset. Throws Error for options, presets, meshes or folders that will not do, and
/// Interrupted after Ctrl-C.
SimulateResult simulate(const SimulateOptions& options, const std::filesystem::path& out,
                        Progress& progress);

/// A camera where it stands on the capsule.
struct Mount {
  Camera camera;
  Rigid3 capsule_from_camera;
  double reach_mm = 0.0;         // of the capsule around the path: a planned path keeps that clear
  double diameter_mm = 0.0;      // of its widest camera: all of them fly the same path
  std::uint64_t noise_seed = 1;  // of what the camera draws alone
};
/// The dataset of one camera; `options.camera` is its name in the dataset.
SimulateResult simulate_mounted(const SimulateOptions& options, const Mount& mount,
                                const std::filesystem::path& out, Progress& progress);
/// One dataset a camera in `out`/<its name>, and `out`/rig.json. What `simulate` does for a rig.
SimulateResult simulate_rig(const SimulateOptions& options, const Rig& rig,
                            const std::filesystem::path& out, Progress& progress);

}  // namespace rugae
