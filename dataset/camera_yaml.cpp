#include "dataset/camera_yaml.h"

#include <fmt/format.h>

#include <sstream>

namespace rugae {

std::string camera_yaml(const Camera& camera) {
  std::string text = fmt::format("name: {}\ndiameter_mm: {:.17g}\nframes_in_paper: {}\nlens:\n",
                                 camera.name, camera.diameter_mm, camera.frames_in_paper);
  std::istringstream lens(lens_yaml(camera.lens, ""));
  for (std::string line; std::getline(lens, line);) text += "  " + line + "\n";
  const Vignetting& v = camera.vignetting;
  text += fmt::format("vignetting:\n  cos4: {}\n  v1: {:.17g}\n  v2: {:.17g}\n  v3: {:.17g}\n",
                      v.cos4, v.v1, v.v2, v.v3);
  const Sensor& s = camera.sensor;
  text += fmt::format(
      "sensor:\n  pixel_pitch_um: {:.17g}\n  fps: {:.17g}\n  bit_depth: {}\n  full_well_e: "
      "{:.17g}\n  read_noise_e: {:.17g}\n  shutter: {}\n",
      s.pixel_pitch_um, s.fps, s.bit_depth, s.full_well_e, s.read_noise_e,
      s.shutter == Shutter::rolling ? "rolling" : "global");
  return text;
}

}  // namespace rugae
