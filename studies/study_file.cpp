#include "studies/study_file.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "core/yaml.h"
#include "recon/features.h"

namespace rugae {
namespace {

// The axes and values that `where` names must be the study's: a gate that holds for nothing is a
// mistake.
void read_where(YamlReader& gate, const std::vector<Axis>& axes, std::vector<Setting>& settings) {
  auto where = gate.child("where");
  if (!where) return;
  for (const std::string& path : where->keys()) {
    const Setting setting{path, where->text(path)};
    std::vector<std::string> paths;
    for (const Axis& axis : axes) paths.push_back(axis.path);
    const auto axis = std::ranges::find(axes, path, &Axis::path);
    check(axis != axes.end(), "{}: '{}' is no axis of the study{}", where->where(path), path,
          did_you_mean(path, paths));
    check(std::ranges::count(axis->values, setting) > 0, "{}: {} is no value of the axis '{}': {}",
          where->where(path), setting.value, path, fmt::join(axis->names(), ", "));
    settings.push_back(setting);
  }
}

void check_known(const YamlReader& yaml, const std::string& key,
                 const std::vector<std::string>& named, const std::vector<std::string>& known) {
  for (const std::string& name : named)
    check(std::ranges::count(known, name) > 0, "{}: {} is '{}', expected one of the study's: {}{}",
          yaml.where(key), key, name, fmt::join(known, ", "), did_you_mean(name, known));
}

Gate read_gate(YamlReader yaml, const StudyOptions& study, const std::vector<Axis>& axes) {
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
  check(!gate.above || !gate.below || *gate.above < *gate.below,
        "{}: gate on {} is above {} and below {}, which no number is", yaml.where("above"),
        gate.metric, *gate.above, *gate.below);
  yaml.get("camera", gate.camera);
  yaml.get("trajectory", gate.trajectory);
  yaml.get("method", gate.method);
  check_known(yaml, "camera", gate.camera, study.cameras);
  check_known(yaml, "trajectory", gate.trajectory, study.trajectories);
  check_known(yaml, "method", gate.method, study.methods);
  read_where(yaml, axes, gate.settings);
  yaml.finish();
  return gate;
}

// The names must be there, at least one of them, and name something that exists.
void read_names(YamlReader& yaml, const std::string& key, const std::string& what,
                const std::string& study_file, std::vector<std::string>& names) {
  yaml.require(key, names);
  check(!names.empty(), "{}: {} is empty, expected at least one", yaml.where(key), key);
  for (std::string& name : names) {
    name = here_or_beside(name, study_file);
    try {
      find_preset(key, what, name);
    } catch (const Error& error) {
      fail("{}: {}", yaml.where(key), error.what());
    }
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

// A file given by a path, program or script, is looked for beside the study file, then under the
// presets' root; what is found in neither is left as it is.
void find_beside(std::string& word, const std::filesystem::path& study_file) {
  if (word.find('/') == std::string::npos) return;
  for (const std::filesystem::path& folder : {study_file.parent_path(), preset_root()}) {
    const auto beside = std::filesystem::absolute(folder / word);
    if (!std::filesystem::exists(beside)) continue;
    word = beside.lexically_normal().string();
    return;
  }
}

std::vector<ExternalMethod> read_commands(YamlReader& study, const std::string& study_file) {
  std::vector<ExternalMethod> commands;
  auto yaml = study.child("commands");
  if (!yaml) return commands;
  for (const std::string& name : yaml->keys()) {
    ExternalMethod method{name, {}};
    yaml->get(name, method.command);
    method.check(yaml->where(name));
    check(std::ranges::count(kMethods, name) == 0 && name.find('/') == std::string::npos,
          "{}: a command is named '{}', expected a name without '/' other than {}",
          yaml->where(name), name, fmt::join(kMethods, " and "));
    for (std::string& word : method.command) find_beside(word, study_file);
    commands.push_back(std::move(method));
  }
  return commands;
}

void read_keep(YamlReader& yaml, StudyOptions& study) {
  int keep = 0;
  yaml.get_choice("keep", keep_names(), keep);
  study.keep = static_cast<Keep>(keep);
  const bool shown = study.details && study.measure == Measure::loop;
  check(study.keep == Keep::all || !shown,
        "{}: keep is results, expected details: false beside it: a cell's details show its frames",
        yaml.where("keep"));
}

void read_measure(YamlReader& yaml, StudyOptions& study) {
  int measure = 0;
  yaml.get_choice("measure", measure_names(), measure);
  study.measure = static_cast<Measure>(measure);
  auto features = yaml.child("features");
  if (!features) return;
  check(study.measure == Measure::features, "{}: features, expected measure: features beside it",
        yaml.where("features"));
  for (const auto& [key, value] :
       {std::pair("step", &study.features.step), std::pair("stride", &study.features.stride)}) {
    features->get(key, *value);
    check(*value >= 1, "{}: {} is {}, expected at least 1", features->where(key), key, *value);
  }
  features->finish();
}

// Feature methods where these are measured; and the paper's stages have one method.
void read_measured_methods(YamlReader& yaml, StudyOptions& study) {
  std::vector<std::string> known{"paper"};
  if (study.measure == Measure::features) {
    known.clear();
    for (const FeatureMethod method : kFeatureMethods) known.push_back(name_of(method));
  }
  study.methods = known;
  yaml.get("methods", study.methods);
  for (const std::string& method : study.methods)
    check(std::ranges::count(known, method) > 0, "{}: method is '{}', expected one of: {}{}",
          yaml.where("methods"), method, fmt::join(known, ", "), did_you_mean(method, known));
}

void read_methods(YamlReader& yaml, const ReconOptions& recon, StudyOptions& study) {
  if (study.measure != Measure::loop) {
    read_measured_methods(yaml, study);
    return;
  }
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

const std::vector<std::string>& measure_names() {
  static const std::vector<std::string> kNames = {"loop", "features", "reflections", "vignetting"};
  return kNames;
}

const std::vector<std::string>& keep_names() {
  static const std::vector<std::string> kNames = {"all", "results"};
  return kNames;
}

const ExternalMethod* StudyOptions::command_of(const std::string& method) const {
  const auto at = std::ranges::find(commands, method, &ExternalMethod::name);
  return at == commands.end() ? nullptr : &*at;
}

StudyOptions read_part_text(const std::string& text, const std::string& name) {
  YamlReader yaml = YamlReader::from_text(text, name);
  StudyOptions study;
  study.text = text;
  yaml.get("title", study.title);
  yaml.get("details", study.details);
  yaml.get("alone", study.alone);
  const Variant base = read_variant(yaml, name);
  read_names(yaml, "cameras", "camera", name, study.cameras);
  read_names(yaml, "trajectories", "trajectory", name, study.trajectories);
  read_seeds(yaml, study.seeds);
  read_measure(yaml, study);
  read_keep(yaml, study);
  study.commands = read_commands(yaml, name);
  read_methods(yaml, base.recon, study);
  const std::vector<Axis> axes = read_axes(yaml);
  for (YamlReader& gate : yaml.children("gates"))
    study.gates.push_back(read_gate(gate, study, axes));
  study.summaries = read_summaries(yaml, axes, study.methods);
  yaml.finish();
  study.variants = read_variants(text, name, axes, study.cameras);
  return study;
}

}  // namespace rugae
