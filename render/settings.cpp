#include "render/settings.h"

#include "core/fields.h"
#include "render/path_trace.h"

namespace rugae {

template <typename Visitor>
void fields(Visitor& v, LensSettings& o) {
  v.flag("vignetting", o.vignetting);
  v.flag("rolling_shutter", o.rolling_shutter);
  v.number("samples", o.samples, 1, 4095);
  v.flag("motion_blur", o.motion_blur);
  v.flag("defocus", o.defocus);
}

template <typename Visitor>
void fields(Visitor& v, LightSettings& o) {
  v.flag("highlights", o.highlights);
  v.number("bounces", o.bounces, 0, kMostBounces);
  v.number("samples", o.samples, 1, kMostPaths);
  v.flag("roulette", o.roulette);
}

template <typename Visitor>
void fields(Visitor& v, SensorSettings& o) {
  v.flag("noise", o.noise);
  v.flag("prnu", o.prnu);
  v.flag("dsnu", o.dsnu);
  v.choice("bayer", o.bayer, {"none", "rggb", "bggr", "grbg", "gbrg"});
  v.choice("white_balance", o.white_balance, {"none", "fixed", "grey_world"});
  v.number("red_gain", o.red_gain, 0.1, 10.0);
  v.number("blue_gain", o.blue_gain, 0.1, 10.0);
  v.choice("tone", o.tone, {"srgb", "gamma22", "linear"});
  v.choice("exposure", o.exposure, {"per_frame", "fixed", "automatic"});
  v.number("exposure_time_s", o.exposure_time_s, 1e-6, 1.0);
  v.number("gain", o.gain, 1.0, 64.0);
  v.number("delay_frames", o.delay_frames, 0, 100);
  v.number("smoothing", o.smoothing, 0.0, 0.99);
}

template <typename Visitor>
void fields(Visitor& v, OutputSettings& o) {
  v.choice("frames", o.frames, {"png", "jpeg"});
  v.number("jpeg_quality", o.jpeg_quality, 1, 100);
  v.flag("adc", o.adc);
  v.flag("mosaic", o.mosaic);
  v.flag("radiance", o.radiance);
  v.flag("paired", o.paired);
}

template <typename Visitor>
void fields(Visitor& v, TruthSettings& o) {
  for (const LabelImage& label : label_images()) v.flag(label.name, o.labels.*label.wanted);
  v.number("tracks", o.tracks, 0, 1000000);
  v.flag("coverage", o.coverage);
}

template <typename Visitor>
void fields(Visitor& v, RenderSettings& o) {
  v.section("lens", o.lens);
  v.section("light", o.light);
  v.section("sensor", o.sensor);
  v.section("output", o.output);
  v.flag("labels", o.labels);
  v.section("truth", o.truth);
}

void RenderSettings::check() const {
  check_fields(*this, "render");
  rugae::check(!output.mosaic || sensor.bayer != Bayer::none,
               "render.output: mosaic is true, but render.sensor.bayer is none");
  rugae::check(
      lens.samples > 1 || !(lens.motion_blur || lens.defocus),
      "render.lens: {} with samples 1 would be noise alone, expected samples of at least 2",
      lens.motion_blur ? "motion_blur" : "defocus");
  rugae::check(!truth.coverage || truth.labels.triangles,
               "render.truth: coverage is counted from triangles, expected triangles to be true");
  rugae::check(!wanted_labels().indirect || light.bounces > 0,
               "render.truth: indirect is true, but render.light.bounces is 0");
}

void read_settings(YamlReader yaml, RenderSettings& settings) {
  read_fields(std::move(yaml), settings);
}

// "a.b=c" is the mapping {a: {b: c}}.
void change_setting(const std::string& change, RenderSettings& settings) {
  const std::size_t equals = change.find('=');
  check(equals != std::string::npos && equals > 0, "'{}' is not a setting, expected path=value",
        change);
  std::string text = change.substr(equals + 1), path = change.substr(0, equals);
  for (std::size_t dot = path.rfind('.'); dot != std::string::npos; dot = path.rfind('.')) {
    text = "{" + path.substr(dot + 1) + ": " + text + "}";
    path.resize(dot);
  }
  read_settings(YamlReader::from_text("{" + path + ": " + text + "}", change), settings);
}

std::vector<Field> list_settings() { return list_of_fields(RenderSettings{}); }

std::string settings_json(const RenderSettings& settings) {
  return json_of_fields(settings).dump();
}

}  // namespace rugae
