#include "studies/study_file.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "core/yaml.h"

namespace rugae {
namespace {

// The axes and values that `where` names must be the study's: a gate that holds for nothing is a
// mistake.
void read_where(YamlReader& gate, const std::vector<Axis>& axes, std::vector<Setting>& settings) {
  auto where = gate.child("where");
  if (!where) return;
  for (const std::string& path : where->keys()) {
    Setting setting{path, {}};
    where->get(path, setting.value);
    std::vector<std::string> paths;
    for (const Axis& axis : axes) paths.push_back(axis.path);
    const auto axis = std::ranges::find(axes, path, &Axis::path);
    check(axis != axes.end(), "{}: '{}' is no axis of the study{}", where->where(path), path,
          did_you_mean(path, paths));
    check(std::ranges::count(axis->values, setting.value) > 0,
          "{}: {} is no value of the axis '{}': {}", where->where(path), setting.value, path,
          fmt::join(axis->values, ", "));
    settings.push_back(std::move(setting));
  }
}

Gate read_gate(YamlReader yaml, const std::vector<Axis>& axes) {
  Gate gate;
  yaml.require("metric", gate.metric);
  yaml.require("reason", gate.reason);
  const auto bound = [&](const std::string& key, std::optional<double>& value) {
    if (!yaml.has(key)) return;
    double number = 0.0;
    yaml.get(key, number);
    value = number;
  };
  bound("above", gate.above);
  bound("below", gate.below);
  check(gate.above || gate.below || !yaml.has("metric"),
        "{}: gate on {} has no bound, expected above or below", yaml.where("metric"), gate.metric);
  yaml.get("camera", gate.camera);
  yaml.get("trajectory", gate.trajectory);
  yaml.get("method", gate.method);
  read_where(yaml, axes, gate.settings);
  yaml.finish();
  return gate;
}

// The names must be there, at least one of them, and name something that exists.
void read_names(YamlReader& yaml, const std::string& key, const std::string& what,
                std::vector<std::string>& names) {
  yaml.require(key, names);
  check(!names.empty(), "{}: {} is empty, expected at least one", yaml.where(key), key);
  for (const std::string& name : names) {
    try {
      find_preset(key, what, name);
    } catch (const Error& error) {
      fail("{}: {}", yaml.where(key), error.what());
    }
  }
}

// All that is not read elsewhere, as one variant.
Variant read_variant(YamlReader& yaml) {
  Variant variant;
  yaml.get("scene", variant.simulate.scene);
  yaml.get("resolution", variant.simulate.resolution);
  yaml.get("frames", variant.simulate.frames);
  if (auto render = yaml.child("render")) read_settings(*render, variant.simulate.render);
  check(variant.simulate.frames >= 0, "{}: frames is {}, expected at least 0 (0: as in the paper)",
        yaml.where("frames"), variant.simulate.frames);
  if (auto recon = yaml.child("recon")) read_options(*recon, variant.recon);
  variant.simulate.check();
  return variant;
}

// The file with these settings in it: an axis can set whatever the file can.
Variant with_settings(const std::string& text, const std::vector<Setting>& settings) {
  std::string changed = text;
  for (const Setting& s : settings) changed = yaml_with(changed, s.path, s.value);
  constexpr const char* kName = "changed";
  try {
    YamlReader yaml = YamlReader::from_text(changed, kName);
    Variant variant = read_variant(yaml);
    variant.settings = settings;
    return variant;
  } catch (const Error& error) {
    // Without the place, which is one in the changed text.
    const std::string what = error.what();
    fail("{}", what.starts_with(kName) ? what.substr(what.find(": ") + 2) : what);
  }
}

Variant read_variant_with(const std::string& text, const std::vector<Axis>& axes,
                          const std::vector<Setting>& settings) {
  try {
    return with_settings(text, settings);
  } catch (const Error& error) {
    // The axis that is wrong alone, or all of them together.
    for (std::size_t i = 0; i < axes.size(); ++i) {
      try {
        with_settings(text, {settings[i]});
      } catch (const Error& alone) {
        fail("{}: axis {}: {}", axes[i].where, shown({settings[i]}), alone.what());
      }
    }
    fail("{}: axes {}: {}", axes.front().where, shown(settings), error.what());
  }
}

void read_seeds(YamlReader& yaml, std::vector<std::uint64_t>& seeds) {
  check(!(yaml.has("seed") && yaml.has("seeds")), "{}: seed and seeds, expected one of them",
        yaml.where("seeds"));
  yaml.get("seed", seeds.front());
  yaml.get("seeds", seeds);
  check(!seeds.empty(), "{}: seeds is empty, expected at least one", yaml.where("seeds"));
  for (const std::uint64_t seed : seeds)
    check(std::ranges::count(seeds, seed) == 1, "{}: seed {} stands twice", yaml.where("seeds"),
          seed);
}

// A program given by a path is looked for beside the study file, then under the presets' root.
std::vector<ExternalMethod> read_commands(YamlReader& study, const std::string& study_file) {
  std::vector<ExternalMethod> commands;
  auto yaml = study.child("commands");
  if (!yaml) return commands;
  for (const std::string& name : yaml->keys()) {
    ExternalMethod method{name, {}};
    yaml->get(name, method.command);
    method.check(yaml->where(name));
    std::string& program = method.command[0];
    if (program.find('/') != std::string::npos)
      for (const std::filesystem::path& folder :
           {std::filesystem::path(study_file).parent_path(), preset_root()}) {
        const auto beside = std::filesystem::absolute(folder / program);
        if (!std::filesystem::exists(beside)) continue;
        program = beside.lexically_normal().string();
        break;
      }
    commands.push_back(std::move(method));
  }
  return commands;
}

void read_methods(YamlReader& yaml, const ReconOptions& recon, StudyOptions& study) {
  study.methods = {recon.method};
  yaml.get("methods", study.methods);
  check(!study.methods.empty(), "{}: methods is empty, expected at least one",
        yaml.where("methods"));
  for (const std::string& method : study.methods) {
    if (study.command_of(method)) continue;
    ReconOptions options = recon;
    options.method = method;
    try {
      options.check();
    } catch (const Error& error) {
      fail("{}: {}{}", yaml.where("methods"), error.what(),
           study.commands.empty() ? "" : ", or a name of commands");
    }
  }
  for (const ExternalMethod& command : study.commands)
    check(std::ranges::count(study.methods, command.name) > 0,
          "{}: '{}' is not among the methods: {}", yaml.where("commands"), command.name,
          fmt::join(study.methods, ", "));
}

}  // namespace

const ExternalMethod* StudyOptions::command_of(const std::string& method) const {
  const auto at = std::ranges::find(commands, method, &ExternalMethod::name);
  return at == commands.end() ? nullptr : &*at;
}

StudyOptions read_study_text(const std::string& text, const std::string& name) {
  YamlReader yaml = YamlReader::from_text(text, name);
  StudyOptions study;
  yaml.get("title", study.title);
  const Variant base = read_variant(yaml);
  read_names(yaml, "cameras", "camera", study.cameras);
  read_names(yaml, "trajectories", "trajectory", study.trajectories);
  read_seeds(yaml, study.seeds);
  study.commands = read_commands(yaml, name);
  read_methods(yaml, base.recon, study);
  const std::vector<Axis> axes = read_axes(yaml);
  for (YamlReader& gate : yaml.children("gates")) study.gates.push_back(read_gate(gate, axes));
  yaml.finish();
  study.variants.clear();
  for (const auto& settings : combinations(axes))
    study.variants.push_back(settings.empty() ? base : read_variant_with(text, axes, settings));
  return study;
}

StudyOptions read_study(const std::filesystem::path& file) {
  return read_study_text(read_text(file), file.string());
}

}  // namespace rugae
