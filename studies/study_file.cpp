#include "studies/study_file.h"

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "core/yaml.h"

namespace rugae {
namespace {

Gate read_gate(YamlReader yaml) {
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

}  // namespace

StudyOptions read_study_text(const std::string& text, const std::string& name) {
  YamlReader yaml = YamlReader::from_text(text, name);
  StudyOptions study;
  yaml.get("title", study.title);
  yaml.get("scene", study.simulate.scene);
  yaml.get("resolution", study.simulate.resolution);
  yaml.get("seed", study.simulate.seed);
  yaml.get("frames", study.simulate.frames);
  if (auto render = yaml.child("render")) read_settings(*render, study.simulate.render);
  check(study.simulate.frames >= 0, "{}: frames is {}, expected at least 0 (0: as in the paper)",
        yaml.where("frames"), study.simulate.frames);
  read_names(yaml, "cameras", "camera", study.cameras);
  read_names(yaml, "trajectories", "trajectory", study.trajectories);
  study.recon.seed = study.simulate.seed;
  if (auto recon = yaml.child("recon")) read_options(*recon, study.recon);
  study.methods = {study.recon.method};
  yaml.get("methods", study.methods);
  check(!study.methods.empty(), "{}: methods is empty, expected at least one",
        yaml.where("methods"));
  for (const std::string& method : study.methods) {
    ReconOptions options = study.recon;
    options.method = method;
    try {
      options.check();
    } catch (const Error& error) {
      fail("{}: {}", yaml.where("methods"), error.what());
    }
  }
  for (YamlReader& gate : yaml.children("gates")) study.gates.push_back(read_gate(gate));
  yaml.finish();
  study.simulate.check();
  return study;
}

StudyOptions read_study(const std::filesystem::path& file) {
  return read_study_text(read_text(file), file.string());
}

}  // namespace rugae
