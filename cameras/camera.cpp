#include "cameras/camera.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/presets.h"
#include "core/units.h"
#include "core/yaml.h"

namespace rugae {
namespace {

const std::vector<std::string> kLensModels = {"brown_conrady", "kannala_brandt"};
const std::vector<std::string> kStops = {"full", "circle", "octagon"};
const std::vector<std::string> kShutters = {"global", "rolling"};

// fx so that the ray through the middle of the left border makes half the horizontal field of view
// with the axis. For Brown-Conrady the border lies at the distorted radius of tan(fov / 2), for
// Kannala-Brandt at theta_d(fov / 2).
double focal_for_fov(Lens lens, double fov_rad) {
  lens.fx = lens.fy = 1.0;
  lens.cx = lens.cy = 0.0;
  const double half = 0.5 * fov_rad;
  const SineCosine of_half = portable_sin_cos(half);
  const auto border = lens.project(Vec3(of_half.sine, 0.0, of_half.cosine));
  check(border.has_value(),
        "a horizontal field of view of {} degrees is beyond the distortion's turning point",
        deg_from_rad(fov_rad));
  return 0.5 * lens.width / border->x();
}

Lens read_lens(YamlReader yaml, const std::string& place) {
  Lens lens;
  int model = 0;
  yaml.get_choice("model", kLensModels, model);
  lens.model = static_cast<LensModel>(model);
  yaml.require("width", lens.width);
  yaml.require("height", lens.height);
  check(lens.width > 0 && lens.height > 0, "{}: image size is {} x {}, expected above 0", place,
        lens.width, lens.height);
  yaml.get("k1", lens.k1);
  yaml.get("k2", lens.k2);
  yaml.get("k3", lens.k3);
  if (lens.model == LensModel::kannala_brandt) {
    yaml.get("k4", lens.k4);
  } else {
    yaml.get("p1", lens.p1);
    yaml.get("p2", lens.p2);
  }
  int stop = 0;
  yaml.get_choice("field_stop", kStops, stop);
  lens.stop.shape = static_cast<StopShape>(stop);
  yaml.get("field_stop_radius", lens.stop.radius);
  lens.stop.check(yaml.where("field_stop_radius"));
  lens.cx = 0.5 * lens.width;
  lens.cy = 0.5 * lens.height;
  yaml.get("cx", lens.cx);
  yaml.get("cy", lens.cy);
  if (yaml.has("horizontal_fov_deg")) {
    check(!yaml.has("fx") && !yaml.has("fy"),
          "{}: horizontal_fov_deg and fx, fy exclude each other", yaml.where("horizontal_fov_deg"));
    double fov_rad = 0.0;
    yaml.get_deg("horizontal_fov_deg", fov_rad);
    check(fov_rad > 0.0 && fov_rad < 2.0 * kPi,
          "{}: horizontal_fov_deg is {}, expected above 0 and below 360",
          yaml.where("horizontal_fov_deg"), deg_from_rad(fov_rad));
    lens.fx = lens.fy = focal_for_fov(lens, fov_rad);
  } else {
    yaml.require("fx", lens.fx);
    yaml.require("fy", lens.fy);
  }
  yaml.finish();
  lens.check(place);
  return lens;
}

// Rows are read within the frame's time. Where a file does not say, the readout takes all of it.
void read_row_time(YamlReader& yaml, int height, Sensor& sensor) {
  const double most_us = 1e6 / (sensor.fps * height);
  if (sensor.shutter == Shutter::rolling) sensor.row_time_us = most_us;
  if (!yaml.has("row_time_us")) return;
  check(sensor.shutter == Shutter::rolling, "{}: row_time_us is given, but the shutter is global",
        yaml.where("row_time_us"));
  yaml.get("row_time_us", sensor.row_time_us);
  check(
      sensor.row_time_us > 0.0 && sensor.row_time_us <= most_us * (1.0 + 1e-12),
      "{}: row_time_us is {}, expected above 0 and at most {:.6g} ({} rows at {} frames a second)",
      yaml.where("row_time_us"), sensor.row_time_us, most_us, height, sensor.fps);
}

void read_fixed_pattern(YamlReader& yaml, Sensor& sensor) {
  yaml.get("prnu", sensor.prnu);
  yaml.get("dsnu_e", sensor.dsnu_e);
  yaml.get("black_level", sensor.black_level);
  check(sensor.prnu >= 0.0 && sensor.prnu <= 0.2, "{}: prnu is {}, expected 0 to 0.2",
        yaml.where("prnu"), sensor.prnu);
  check(sensor.dsnu_e >= 0.0 && sensor.dsnu_e <= sensor.full_well_e,
        "{}: dsnu_e is {}, expected 0 to the full well's {}", yaml.where("dsnu_e"), sensor.dsnu_e,
        sensor.full_well_e);
  const int half = 1 << (sensor.bit_depth - 1);
  check(sensor.black_level >= 0 && sensor.black_level <= half,
        "{}: black_level is {}, expected 0 to {}", yaml.where("black_level"), sensor.black_level,
        half);
}

Sensor read_sensor(YamlReader yaml, int height) {
  Sensor sensor;
  yaml.require("pixel_pitch_um", sensor.pixel_pitch_um);
  yaml.require("fps", sensor.fps);
  yaml.require("bit_depth", sensor.bit_depth);
  yaml.require("full_well_e", sensor.full_well_e);
  yaml.require("read_noise_e", sensor.read_noise_e);
  int shutter = 0;
  yaml.get_choice("shutter", kShutters, shutter);
  sensor.shutter = static_cast<Shutter>(shutter);
  const auto positive = [&yaml](const char* key, double value) {
    check(value > 0.0, "{}: {} is {}, expected above 0", yaml.where(key), key, value);
  };
  positive("pixel_pitch_um", sensor.pixel_pitch_um);
  positive("fps", sensor.fps);
  positive("full_well_e", sensor.full_well_e);
  check(sensor.read_noise_e >= 0.0, "{}: read_noise_e is {}, expected at least 0",
        yaml.where("read_noise_e"), sensor.read_noise_e);
  check(sensor.bit_depth >= 8 && sensor.bit_depth <= 16, "{}: bit_depth is {}, expected 8 to 16",
        yaml.where("bit_depth"), sensor.bit_depth);
  read_row_time(yaml, height, sensor);
  read_fixed_pattern(yaml, sensor);
  yaml.finish();
  return sensor;
}

Focus read_focus(YamlReader yaml) {
  Focus focus;
  yaml.require("f_number", focus.f_number);
  yaml.require("distance_mm", focus.distance_mm);
  check(focus.f_number >= 0.5 && focus.f_number <= 100.0, "{}: f_number is {}, expected 0.5 to 100",
        yaml.where("f_number"), focus.f_number);
  check(focus.distance_mm > 0.0 && focus.distance_mm <= 1e6,
        "{}: distance_mm is {}, expected above 0 and at most 1000000", yaml.where("distance_mm"),
        focus.distance_mm);
  yaml.finish();
  return focus;
}

}  // namespace

double aperture_radius_mm(const Camera& camera) {
  if (!(camera.focus.f_number > 0.0)) return 0.0;
  const double focal_mm = 1e-3 * camera.lens.fx * camera.sensor.pixel_pitch_um;
  return 0.5 * focal_mm / camera.focus.f_number;
}

namespace {

// Corners alone do not see a polynomial that dips below 0 between them and the centre.
void check_fall_off(const Camera& camera, const std::string& where) {
  constexpr int kSteps = 256;
  const Lens& lens = camera.lens;
  double reach_px = 0.0;
  Vec2 farthest = Vec2::Zero();
  for (const Vec2& corner :
       {Vec2(0, 0), Vec2(lens.width, 0), Vec2(0, lens.height), Vec2(lens.width, lens.height)}) {
    const double distance_px = (corner - Vec2(lens.cx, lens.cy)).norm();
    if (distance_px > reach_px) reach_px = distance_px, farthest = corner;
  }
  Vignetting polynomial = camera.vignetting;
  polynomial.cos4 = false;
  for (int i = 0; i <= kSteps; ++i) {
    const Vec2 pixel = Vec2(lens.cx, lens.cy) +
                       static_cast<double>(i) / kSteps * (farthest - Vec2(lens.cx, lens.cy));
    const double light = vignette_at(polynomial, lens, pixel, Vec3::UnitZ());
    check(light > 0.0, "{}: vignetting is {:.3g} at pixel ({:.1f}, {:.1f}), expected above 0",
          where, light, pixel.x(), pixel.y());
  }
}

}  // namespace

Camera load_camera(const std::string& name_or_path) {
  const auto file = find_preset("cameras", "camera", name_or_path);
  YamlReader yaml = YamlReader::from_file(file);
  Camera camera;
  camera.name = file.stem().string();
  yaml.get("name", camera.name);
  check(std::ranges::none_of(camera.name, [](unsigned char c) { return std::iscntrl(c) != 0; }),
        "{}: name has a line break or another control character", yaml.where("name"));
  yaml.get("diameter_mm", camera.diameter_mm);
  yaml.get("frames_in_paper", camera.frames_in_paper);
  check(camera.diameter_mm >= 0.0, "{}: diameter_mm is {}, expected at least 0",
        yaml.where("diameter_mm"), camera.diameter_mm);
  check(camera.frames_in_paper >= 0, "{}: frames_in_paper is {}, expected at least 0",
        yaml.where("frames_in_paper"), camera.frames_in_paper);
  const std::string lens_place = yaml.where("lens");
  const auto lens = yaml.child("lens");
  check(lens.has_value(), "{}: key 'lens' is missing", lens_place);
  camera.lens = read_lens(*lens, lens_place);
  if (auto focus = yaml.child("focus")) camera.focus = read_focus(std::move(*focus));
  if (auto vignetting = yaml.child("vignetting")) {
    vignetting->get("cos4", camera.vignetting.cos4);
    vignetting->get("v1", camera.vignetting.v1);
    vignetting->get("v2", camera.vignetting.v2);
    vignetting->get("v3", camera.vignetting.v3);
    vignetting->finish();
  }
  const auto sensor = yaml.child("sensor");
  check(sensor.has_value(), "{}: key 'sensor' is missing", yaml.where("sensor"));
  camera.sensor = read_sensor(*sensor, camera.lens.height);
  camera.lights = read_lights(yaml);
  yaml.finish();
  const double w = camera.lens.width, h = camera.lens.height;
  for (const Vec2& corner : {Vec2(0, 0), Vec2(w, 0), Vec2(0, h), Vec2(w, h)}) {
    // Beyond 90 degrees cos^4 is 0: dark, but no mistake.
    const auto ray = camera.lens.unproject(corner);
    check((ray && !(ray->z() > 0.0)) || vignette_at(camera.vignetting, camera.lens, corner) > 0.0,
          "{}: vignetting leaves no light at the image corner ({}, {})", yaml.where("vignetting"),
          corner.x(), corner.y());
  }
  check_fall_off(camera, yaml.where("vignetting"));
  return camera;
}

int frames_of_trajectory(const Camera& camera, int trajectory) {
  check(trajectory >= 1 && trajectory <= 6, "trajectory {}: the paper has 1 to 6", trajectory);
  return camera.frames_in_paper / 6 + (trajectory <= camera.frames_in_paper % 6 ? 1 : 0);
}

Calibration load_calibration(const std::filesystem::path& file) {
  YamlReader yaml = YamlReader::from_file(file);
  Calibration calibration;
  if (yaml.has("row_time_us")) {
    double& row_time_us = calibration.row_time_us.emplace(0.0);
    yaml.get("row_time_us", row_time_us);
    check(row_time_us >= 0.0, "{}: row_time_us is {}, expected 0 (a global shutter) or above",
          yaml.where("row_time_us"), row_time_us);
  }
  if (yaml.has("lights")) calibration.lights = read_lights(yaml);
  calibration.lens = read_lens(std::move(yaml), file.string());
  return calibration;
}

Lens load_lens(const std::filesystem::path& file) { return load_calibration(file).lens; }

namespace {

// The lens' keys, each line behind `indent`, with 17 digits so that reading gives back the same
// doubles.
std::string lens_lines(const Lens& lens, const std::string& indent) {
  std::string text =
      fmt::format("{0}model: {1}\n{0}width: {2}\n{0}height: {3}\n", indent,
                  kLensModels[static_cast<int>(lens.model)], lens.width, lens.height);
  const auto number = [&](const char* key, double value) {
    text += fmt::format("{}{}: {:.17g}\n", indent, key, value);
  };
  number("fx", lens.fx);
  number("fy", lens.fy);
  number("cx", lens.cx);
  number("cy", lens.cy);
  number("k1", lens.k1);
  number("k2", lens.k2);
  number("k3", lens.k3);
  if (lens.model == LensModel::kannala_brandt) {
    number("k4", lens.k4);
  } else {
    number("p1", lens.p1);
    number("p2", lens.p2);
  }
  if (lens.stop.shape != StopShape::full) {
    text += fmt::format("{}field_stop: {}\n", indent, kStops[static_cast<int>(lens.stop.shape)]);
    number("field_stop_radius", lens.stop.radius);
  }
  return text;
}

}  // namespace

std::string calibration_yaml(const Calibration& calibration, const std::string& comment) {
  std::string text = comment.empty() ? "" : "# " + comment + "\n";
  text +=
      "# pixels; the centre of the first pixel is (0.5, 0.5)\n" + lens_lines(calibration.lens, "");
  if (calibration.row_time_us)
    text += fmt::format("row_time_us: {:.17g}\n", *calibration.row_time_us);
  if (calibration.lights) text += lights_yaml(*calibration.lights);
  return text;
}

std::string lens_yaml(const Lens& lens, const std::string& comment) {
  return calibration_yaml({lens, {}, {}}, comment);
}

namespace {

// Names that YAML would read as something else stand in quotes.
std::string quoted(const std::string& name) {
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.' || c == '/';
  };
  const bool null = name == "null" || name == "Null" || name == "NULL";
  if (!name.empty() && !null && std::ranges::all_of(name, plain)) return name;
  return nlohmann::json(name).dump();
}

}  // namespace

std::string camera_yaml(const Camera& camera) {
  const Vignetting& v = camera.vignetting;
  const Sensor& s = camera.sensor;
  std::string text = fmt::format("name: {}\nframes_in_paper: {}\ndiameter_mm: {:.17g}\nlens:\n",
                                 quoted(camera.name), camera.frames_in_paper, camera.diameter_mm);
  text += lens_lines(camera.lens, "  ");
  text += fmt::format("vignetting:\n  cos4: {}\n  v1: {:.17g}\n  v2: {:.17g}\n  v3: {:.17g}\n",
                      v.cos4, v.v1, v.v2, v.v3);
  text += fmt::format("sensor:\n  pixel_pitch_um: {:.17g}\n  fps: {:.17g}\n  bit_depth: {}\n",
                      s.pixel_pitch_um, s.fps, s.bit_depth);
  text += fmt::format("  full_well_e: {:.17g}\n  read_noise_e: {:.17g}\n  shutter: {}\n",
                      s.full_well_e, s.read_noise_e, kShutters[static_cast<int>(s.shutter)]);
  if (s.shutter == Shutter::rolling) text += fmt::format("  row_time_us: {:.17g}\n", s.row_time_us);
  text += fmt::format("  prnu: {:.17g}\n  dsnu_e: {:.17g}\n  black_level: {}\n", s.prnu, s.dsnu_e,
                      s.black_level);
  if (camera.focus.f_number > 0.0)
    text += fmt::format("focus:\n  f_number: {:.17g}\n  distance_mm: {:.17g}\n",
                        camera.focus.f_number, camera.focus.distance_mm);
  text += lights_yaml(camera.lights);
  return text;
}

}  // namespace rugae
