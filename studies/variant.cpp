#include "studies/variant.h"

#include <unistd.h>

#include <filesystem>

#include "core/check.h"
#include "core/files.h"
#include "scenes/scene_file.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

// Errors in a text that is not the user's file are told without the place in it.
std::string without_place(const std::string& what, const std::string& name) {
  return what.starts_with(name) ? what.substr(what.find(": ") + 2) : what;
}

bool is_path(const std::string& name_or_path) {
  return fs::path(name_or_path).has_extension() || name_or_path.find('/') != std::string::npos;
}

// A scene is read from a file, so it becomes one for the time of reading.
void check_scene(const std::string& text, const std::string& where) {
  const fs::path file =
      fs::temp_directory_path() / fmt::format("rugae_scene_{}_{}.yaml", getpid(), text.size());
  write_atomic(file, text);
  std::string problem;
  try {
    read_scene_file(file, 1);
  } catch (const Error& error) {
    problem = without_place(error.what(), file.string());
  }
  fs::remove(file);
  check(problem.empty(), "{}: {}", where, problem);
}

void read_scene(YamlReader& yaml, const std::string& study_file, Variant& variant) {
  if (!yaml.has_mapping("scene")) {
    yaml.get("scene", variant.simulate.scene);
    return;
  }
  variant.scene_text = yaml.text("scene") + "\n";
  std::string& like = variant.simulate.scene;
  yaml.child("scene")->get("like", like);
  if (is_path(like)) {  // the scene's own file lies elsewhere
    like = fs::absolute(fs::path(study_file).parent_path() / like).lexically_normal().string();
    variant.scene_text = yaml_with(variant.scene_text, "like", like) + "\n";
  }
  check_scene(variant.scene_text, yaml.where("scene"));
}

// A change below a scene that is a name builds on what has the name.
std::string changed_text(const std::string& text, const Change& change) {
  YamlReader yaml = YamlReader::from_text(text, "study");
  if (!change.path.starts_with("scene.") || yaml.has_mapping("scene"))
    return yaml_with(text, change.path, change.value);
  std::string scene = SimulateOptions().scene;
  yaml.get("scene", scene);
  return yaml_with(yaml_with(text, "scene", fmt::format("{{like: \"{}\"}}", scene)), change.path,
                   change.value);
}

Variant variant_with(const std::string& text, const std::string& study_file,
                     const std::vector<Setting>& settings) {
  // A name that no file has, in the folder of the one that is changed: paths go from there.
  const std::string name = (fs::path(study_file).parent_path() / "<changed>").string();
  try {
    std::string changed = text;
    for (const Setting& s : settings)
      for (const Change& change : s.changes) changed = changed_text(changed, change);
    YamlReader yaml = YamlReader::from_text(changed, name);
    Variant variant = read_variant(yaml, name);
    variant.settings = settings;
    return variant;
  } catch (const Error& error) {
    fail("{}", without_place(error.what(), name));
  }
}

Variant variant_of_axes(const std::string& text, const std::string& study_file,
                        const std::vector<Axis>& axes, const std::vector<Setting>& settings) {
  try {
    return variant_with(text, study_file, settings);
  } catch (const Error& error) {
    // The axis that is wrong alone, or all of them together.
    for (std::size_t i = 0; i < axes.size(); ++i) {
      try {
        variant_with(text, study_file, {settings[i]});
      } catch (const Error& alone) {
        fail("{}: axis {}: {}", axes[i].where, shown({settings[i]}), alone.what());
      }
    }
    fail("{}: axes {}: {}", axes.front().where, shown(settings), error.what());
  }
}

}  // namespace

Variant read_variant(YamlReader& study, const std::string& study_file) {
  Variant variant;
  read_scene(study, study_file, variant);
  study.get("resolution", variant.simulate.resolution);
  study.get("frames", variant.simulate.frames);
  study.get("first", variant.simulate.first);
  if (auto render = study.child("render")) read_settings(*render, variant.simulate.render);
  check(variant.simulate.frames >= 0, "{}: frames is {}, expected at least 0 (0: as in the paper)",
        study.where("frames"), variant.simulate.frames);
  if (auto recon = study.child("recon")) read_options(*recon, variant.recon);
  int replace = 0;
  study.get_choice("replace", replace_names(), replace);
  variant.replace = static_cast<Replace>(replace);
  study.get("calibrate", variant.calibrate);
  study.get("lens_error", variant.lens_error);
  check(variant.lens_error > -0.5 && variant.lens_error < 0.5,
        "{}: lens_error is {}, expected -0.5 to 0.5", study.where("lens_error"),
        variant.lens_error);
  if (variant.replace == Replace::lens) {
    variant.calibrate = false;
    variant.lens_error = 0.0;
  }
  variant.simulate.check();
  return variant;
}

Variant with_clean_frames(Variant variant) {
  RenderSettings& render = variant.simulate.render;
  render.light.highlights = false;
  render.lens.vignetting = render.lens.motion_blur = render.lens.defocus = false;
  render.sensor.noise = render.sensor.prnu = render.sensor.dsnu = false;
  return variant;
}

std::vector<Variant> read_variants(const std::string& text, const std::string& study_file,
                                   const std::vector<Axis>& axes) {
  std::vector<Variant> variants;
  for (const auto& settings : combinations(axes))
    variants.push_back(variant_of_axes(text, study_file, axes, settings));
  return variants;
}

}  // namespace rugae
