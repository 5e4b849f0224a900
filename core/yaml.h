#pragma once
// YAML onto option structs, strictly: a key nobody asked for, a wrong type, or a value out of range
// is an Error with file, line, column and the nearest known key.
//
//   YamlReader yaml = YamlReader::from_file(file);
//   yaml.get("tau_px", options.tau_px);          // keeps the default where the key is absent
//   yaml.require("width", camera.width);         // an absent key is an Error
//   if (auto sensor = yaml.child("sensor")) { ...; sensor->finish(); }
//   yaml.finish();                               // throws on unknown keys

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/types.h"

namespace YAML {
class Node;
}

namespace rugae {

class YamlReader {
 public:
  static YamlReader from_file(const std::filesystem::path& file);
  /// `name` stands for the file in errors.
  static YamlReader from_text(const std::string& text, const std::string& name);
  ~YamlReader();
  YamlReader(YamlReader&&) noexcept;
  YamlReader& operator=(YamlReader&&) noexcept;
  YamlReader(const YamlReader&);

  bool has(const std::string& key) const;
  std::vector<std::string> keys() const;           // in the file's order
  bool has_mapping(const std::string& key) const;  // has it, and its value is a mapping
  void get(const std::string& key, double& value);
  void get(const std::string& key, int& value);
  void get(const std::string& key, std::uint64_t& value);
  void get(const std::string& key, bool& value);
  void get(const std::string& key, std::string& value);
  void get(const std::string& key, Vec2& value);
  void get(const std::string& key, Vec3& value);
  void get(const std::string& key, Vec4& value);
  void get(const std::string& key, std::vector<double>& value);
  void get(const std::string& key,
           std::vector<std::string>& value);  // a single word is a list of one
  void get(const std::string& key, std::vector<std::uint64_t>& value);  // likewise
  /// A key `<name>_deg` holds degrees, the variable radians.
  void get_deg(const std::string& key, double& value_rad);

  template <typename T>
  void require(const std::string& key, T& value) {
    require_key(key);
    get(key, value);
  }
  /// One of `names`; the index is written to `value`. The nearest name is offered otherwise.
  void get_choice(const std::string& key, const std::vector<std::string>& names, int& value);

  /// The value as text: a scalar as it is, a mapping or list in flow style on one line.
  std::string text(const std::string& key);
  /// The same of each entry of a list.
  std::vector<std::string> texts(const std::string& key);

  std::optional<YamlReader> child(const std::string& key);
  std::vector<YamlReader> children(const std::string& key);  // a list of mappings
  /// "file:line:column" of a key's value (of the mapping itself where the key is absent): for
  /// errors of range.
  std::string where(const std::string& key) const;
  /// Throws Error naming the first key that was never asked for, and the nearest one that was.
  void finish() const;

 private:
  YamlReader(const YAML::Node& node, std::string name);
  void require_key(const std::string& key);
  const YAML::Node* find(const std::string& key);

  struct State;
  std::unique_ptr<State> state_;
};

/// The same document with `value` at a path of keys such as "render.sensor.noise"; mappings on the
/// way are made where they are absent. A value that begins with { or [ is a mapping or a list in
/// flow style, as YamlReader::text() gives it. Throws Error where something that is no mapping
/// stands in the way. Places in the new text are not those in the old.
std::string yaml_with(const std::string& text, const std::string& path, const std::string& value);

}  // namespace rugae
