#include "recon/options.h"

#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "core/check.h"
#include "core/units.h"

namespace rugae {
namespace {

const std::vector<std::string> kMethods = {"paper"};
const std::vector<std::string> kInpaintings = {"telea", "navier_stokes"};

// One list of fields a struct: the key, the variable, and the range that reading, checking and
// writing share.

template <typename Visitor>
void fields(Visitor& v, ReflectionOptions& o) {
  v.flag("suppress_for_pose", o.suppress_for_pose);
  v.flag("suppress_for_map", o.suppress_for_map);
  v.choice("inpainting", o.inpainting, kInpaintings);
  v.number("closing_px", o.closing_px, 1, 101);
  v.number("inpaint_radius_px", o.inpaint_radius_px, 1.0, 50.0);
}

template <typename Visitor>
void fields(Visitor& v, PreprocessOptions& o) {
  v.section("reflections", o.reflections);
  v.flag("undistort", o.undistort);
  v.flag("devignette", o.devignette);
}

template <typename Visitor>
void fields(Visitor& v, KeyframeOptions& o) {
  v.number("mean_flow_px", o.mean_flow_px, 0.1, 1000.0);
  v.number("max_gap", o.max_gap, 1, 10000);
}

template <typename Visitor>
void fields(Visitor& v, AlignOptions& o) {
  v.number("grid_px", o.grid_px, 2, 64);
  v.number("ransac_threshold_px", o.ransac_threshold_px, 0.1, 100.0);
  v.number("patch_radius_px", o.patch_radius_px, 2, 100);
  v.number("stop_mse", o.stop_mse, 0.0, 1.0);
  v.number("max_iterations", o.max_iterations, 1, 10000);
  v.number("min_inliers", o.min_inliers, 4, 1000000);
  v.number("neighbours", o.neighbours, 1, 100);
}

template <typename Visitor>
void fields(Visitor& v, TrackOptions& o) {
  v.number("spacing_px", o.spacing_px, 2.0, 200.0);
}

template <typename Visitor>
void fields(Visitor& v, BundleOptions& o) {
  v.number("huber_px", o.huber_px, 1e-3, 1000.0);
  v.angle("min_parallax", o.min_parallax_rad, 0.0, 0.5 * kPi);
  v.number("max_iterations", o.max_iterations, 1, 10000);
  v.number("min_resection_inliers", o.min_resection_inliers, 4, 1000000);
}

template <typename Visitor>
void fields(Visitor& v, MosaicOptions& o) {
  v.angle("max_view_angle", o.max_view_angle_rad, 0.0, 0.5 * kPi);
  v.number("bands", o.bands, 1, 16);
}

template <typename Visitor>
void fields(Visitor& v, ShadingOptions& o) {
  v.number("iterations", o.iterations, 1, 10000);
  v.number("w_n", o.w_n, 0.0, 1.0);
  v.number("s_0", o.s_0, 0.0, 1000.0);
}

template <typename Visitor>
void fields(Visitor& v, MapOptions& o) {
  v.number("voxel_share", o.voxel_share, 1.0 / 4096.0, 0.5);
}

template <typename Visitor>
void fields(Visitor& v, ReconOptions& o) {
  v.word("method", o.method, kMethods);
  v.section("preprocess", o.preprocess);
  v.section("keyframes", o.keyframes);
  v.section("align", o.align);
  v.section("tracks", o.tracks);
  v.section("bundle", o.bundle);
  v.section("mosaic", o.mosaic);
  v.section("shading", o.shading);
  v.section("map", o.map);
  v.flag("pictures", o.pictures);
  v.seed("seed", o.seed);
}

// `place` is where the value stands: the file's line and column, or the struct's name. A NaN is out
// of every range.
template <typename T>
void check_range(const std::string& place, const std::string& key, T value, T low, T high) {
  check(value >= low && value <= high, "{}: {} is {}, expected {} to {}", place, key, value, low,
        high);
}

void check_word(const std::string& place, const std::string& key, const std::string& value,
                const std::vector<std::string>& known) {
  for (const std::string& word : known) {
    if (value == word) return;
  }
  fail("{}: {} '{}' is not known, expected {}{}", place, key, value, fmt::join(known, " or "),
       did_you_mean(value, known));
}

struct Checker {
  std::string place;

  void flag(const char*, bool&) {}
  void seed(const char*, std::uint64_t&) {}
  template <typename T, typename Bound>
  void number(const char* key, T& value, Bound low, Bound high) {
    check_range<T>(place, key, value, low, high);
  }
  void angle(const std::string& key, double& value_rad, double low_rad, double high_rad) {
    check_range(place, key + "_rad", value_rad, low_rad, high_rad);
  }
  template <typename Enum>
  void choice(const char* key, Enum& value, const std::vector<std::string>& names) {
    check_range<int>(place, key, static_cast<int>(value), 0, static_cast<int>(names.size()) - 1);
  }
  void word(const char* key, std::string& value, const std::vector<std::string>& known) {
    check_word(place, key, value, known);
  }
  template <typename Options>
  void section(const char* key, Options& options) {
    Checker inner{place + "." + key};
    fields(inner, options);
  }
};

struct Reader {
  YamlReader yaml;

  void flag(const char* key, bool& value) { yaml.get(key, value); }
  void seed(const char* key, std::uint64_t& value) { yaml.get(key, value); }
  template <typename T, typename Bound>
  void number(const char* key, T& value, Bound low, Bound high) {
    yaml.get(key, value);
    check_range<T>(yaml.where(key), key, value, low, high);
  }
  void angle(const std::string& key, double& value_rad, double low_rad, double high_rad) {
    yaml.get_deg(key + "_deg", value_rad);
    check_range(yaml.where(key + "_deg"), key + "_deg", deg_from_rad(value_rad),
                deg_from_rad(low_rad), deg_from_rad(high_rad));
  }
  template <typename Enum>
  void choice(const char* key, Enum& value, const std::vector<std::string>& names) {
    int index = static_cast<int>(value);
    yaml.get_choice(key, names, index);
    value = static_cast<Enum>(index);
  }
  void word(const char* key, std::string& value, const std::vector<std::string>& known) {
    yaml.get(key, value);
    check_word(yaml.where(key), key, value, known);
  }
  template <typename Options>
  void section(const char* key, Options& options) {
    if (std::optional<YamlReader> child = yaml.child(key)) {
      Reader inner{std::move(*child)};
      fields(inner, options);
      inner.yaml.finish();
    }
  }
};

struct Writer {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();

  void flag(const char* key, bool& value) { json[key] = value; }
  void seed(const char* key, std::uint64_t& value) { json[key] = value; }
  template <typename T, typename Bound>
  void number(const char* key, T& value, Bound, Bound) {
    json[key] = value;
  }
  void angle(const std::string& key, double& value_rad, double, double) {
    json[key + "_rad"] = value_rad;
  }
  template <typename Enum>
  void choice(const char* key, Enum& value, const std::vector<std::string>& names) {
    json[key] = names[static_cast<std::size_t>(value)];
  }
  void word(const char* key, std::string& value, const std::vector<std::string>&) {
    json[key] = value;
  }
  template <typename Options>
  void section(const char* key, Options& options) {
    Writer inner;
    fields(inner, options);
    json[key] = std::move(inner.json);
  }
};

template <typename Options>
void check_all(Options options, const char* name) {
  Checker checker{name};
  fields(checker, options);
}

}  // namespace

void ReflectionOptions::check() const { check_all(*this, "reflections"); }
void PreprocessOptions::check() const { check_all(*this, "preprocess"); }
void KeyframeOptions::check() const { check_all(*this, "keyframes"); }
void AlignOptions::check() const { check_all(*this, "align"); }
void TrackOptions::check() const { check_all(*this, "tracks"); }
void BundleOptions::check() const { check_all(*this, "bundle"); }
void MosaicOptions::check() const { check_all(*this, "mosaic"); }
void ShadingOptions::check() const { check_all(*this, "shading"); }
void MapOptions::check() const { check_all(*this, "map"); }
void ReconOptions::check() const { check_all(*this, "recon"); }

void read_options(YamlReader yaml, ReconOptions& options) {
  Reader reader{std::move(yaml)};
  fields(reader, options);
  reader.yaml.finish();
}

std::string to_json_text(const ReconOptions& options) {
  Writer writer;
  ReconOptions copy = options;
  fields(writer, copy);
  return writer.json.dump();
}

}  // namespace rugae
