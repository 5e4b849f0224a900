// A study made of others, each with changes of its own.

#include <algorithm>

#include "core/check.h"
#include "core/files.h"
#include "core/presets.h"
#include "studies/study_file.h"

namespace rugae {
namespace {

namespace fs = std::filesystem;

// A preset's name, or a path from the folder of the file that says it.
fs::path find_part(YamlReader& yaml, const std::string& study, const std::string& from) {
  const bool path = fs::path(study).has_extension() || study.find('/') != std::string::npos;
  try {
    return find_preset("studies", "study",
                       path ? (fs::path(from).parent_path() / study).string() : study);
  } catch (const Error& error) {
    fail("{}: {}", yaml.where("study"), error.what());
  }
}

StudyOptions read_part(YamlReader yaml, const std::string& from) {
  std::string study;
  yaml.require("study", study);
  const fs::path file = find_part(yaml, study, from);
  std::string name = file.stem().string(), text = read_text(file);
  yaml.get("name", name);
  const std::string where = yaml.where("with");
  if (auto with = yaml.child("with"))
    for (const std::string& path : with->keys()) text = yaml_with(text, path, with->text(path));
  yaml.finish();
  StudyOptions part;
  try {
    const bool parts = YamlReader::from_text(text, file.string()).has("parts");
    check(!parts, "{}: has parts itself, expected a study without", file.string());
    part = read_part_text(text, file.string());
  } catch (const Error& error) {
    fail("{}: part '{}' with its changes: {}", where, name, error.what());
  }
  part.name = name;
  return part;
}

}  // namespace

Study read_study_text(const std::string& text, const std::string& name) {
  YamlReader yaml = YamlReader::from_text(text, name);
  Study study;
  study.text = text;
  if (!yaml.has("parts")) {
    study.parts = {read_part_text(text, name)};
    study.title = study.parts[0].title;
    return study;
  }
  yaml.require("title", study.title);
  for (YamlReader& part : yaml.children("parts")) {
    study.parts.push_back(read_part(part, name));
    const std::string& last = study.parts.back().name;
    check(std::ranges::count(study.parts, last, &StudyOptions::name) == 1,
          "{}: two parts have the name '{}'; give one another `name`", part.where("study"), last);
  }
  check(!study.parts.empty(), "{}: parts is empty, expected at least one", yaml.where("parts"));
  yaml.finish();
  return study;
}

Study read_study(const fs::path& file) { return read_study_text(read_text(file), file.string()); }

}  // namespace rugae
