#include "studies/variant.h"

#include <unistd.h>

#include <filesystem>

#include "cameras/camera.h"
#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "scenes/scene_file.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

const std::string kCamera = "camera.";  // what paths into a camera's file begin with

// Errors in a text that is not the user's file are told without the place in it.
std::string without_place(const std::string& what, const std::string& name) {
  return what.starts_with(name) ? what.substr(what.find(": ") + 2) : what;
}

// What is read from a file becomes one for the time of reading. Throws Error without the place in
// it.
template <typename Read>
void check_text(const std::string& text, const Read& read) {
  const fs::path file =
      fs::temp_directory_path() / fmt::format("rugae_text_{}_{}.yaml", getpid(), text.size());
  write_atomic(file, text);
  std::string problem;
  try {
    read(file);
  } catch (const Error& error) {
    problem = without_place(error.what(), file.string());
  }
  fs::remove(file);
  check(problem.empty(), "{}", problem);
}

void check_scene(const std::string& text, const std::string& where) {
  try {
    check_text(text, [](const fs::path& file) { read_scene_file(file, 1); });
  } catch (const Error& error) {
    fail("{}: {}", where, error.what());
  }
}

void check_cameras(const std::vector<std::string>& cameras, const std::vector<Change>& changes) {
  if (changes.empty()) return;
  for (const std::string& camera : cameras) {
    try {
      check_text(camera_text(camera, changes),
                 [](const fs::path& file) { load_camera(file.string()); });
    } catch (const Error& error) {
      fail("camera '{}': {}", camera, error.what());
    }
  }
}

void read_scene(YamlReader& yaml, const std::string& study_file, Variant& variant) {
  if (!yaml.has_mapping("scene")) {
    std::string& scene = variant.simulate.scene;
    yaml.get("scene", scene);
    scene = here_or_beside(scene, study_file);
    try {
      find_preset("scenes", "scene", scene);
    } catch (const Error& error) {
      fail("{}: {}", yaml.where("scene"), error.what());
    }
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
                     const std::vector<std::string>& cameras,
                     const std::vector<Setting>& settings) {
  // A name that no file has, in the folder of the one that is changed: paths go from there.
  const std::string name = (fs::path(study_file).parent_path() / "<changed>").string();
  try {
    std::string changed = text;
    std::vector<Change> of_camera;
    for (const Setting& s : settings)
      for (const Change& change : s.changes) {
        if (change.path.starts_with(kCamera))
          of_camera.push_back({change.path.substr(kCamera.size()), change.value});
        else
          changed = changed_text(changed, change);
      }
    YamlReader yaml = YamlReader::from_text(changed, name);
    Variant variant = read_variant(yaml, name);
    variant.settings = settings;
    check_cameras(cameras, of_camera);
    variant.camera_changes = std::move(of_camera);
    return variant;
  } catch (const Error& error) {
    fail("{}", without_place(error.what(), name));
  }
}

Variant variant_of_axes(const std::string& text, const std::string& study_file,
                        const std::vector<std::string>& cameras, const std::vector<Axis>& axes,
                        const std::vector<Setting>& settings) {
  try {
    return variant_with(text, study_file, cameras, settings);
  } catch (const Error& error) {
    // The axis that is wrong alone, or all of them together.
    for (std::size_t i = 0; i < axes.size(); ++i) {
      try {
        variant_with(text, study_file, cameras, {settings[i]});
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

std::string camera_text(const std::string& camera, const std::vector<Change>& changes) {
  std::string text = read_text(find_preset("cameras", "camera", camera));
  for (const Change& change : changes) text = yaml_with(text, change.path, change.value);
  return text + "\n";
}

std::vector<Variant> read_variants(const std::string& text, const std::string& study_file,
                                   const std::vector<Axis>& axes,
                                   const std::vector<std::string>& cameras) {
  std::vector<Variant> variants;
  for (const auto& settings : combinations(axes))
    variants.push_back(variant_of_axes(text, study_file, cameras, axes, settings));
  return variants;
}

}  // namespace rugae
