#pragma once
// A camera whose frames are quickly rendered.

#include <fmt/format.h>

#include <filesystem>

#include "core/files.h"

namespace rugae {

/// Writes small.yaml into the folder.
inline void write_small_camera(const std::filesystem::path& folder, int width_px, int height_px) {
  write_atomic(folder / "small.yaml",
               fmt::format("name: small\nframes_in_paper: 0\ndiameter_mm: 5\n"
                           "lens: {{model: brown_conrady, width: {}, height: {}, "
                           "horizontal_fov_deg: 90}}\n"
                           "sensor: {{pixel_pitch_um: 3, fps: 30, bit_depth: 10, full_well_e: "
                           "10000, read_noise_e: 5, shutter: global}}\n",
                           width_px, height_px));
}

}  // namespace rugae
