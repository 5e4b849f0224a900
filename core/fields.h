#pragma once
// Options described once. A struct's `fields` lists for each member its key, the variable and its
// range; reading from YAML, checking, listing and writing as JSON are visitors of that one list.
//
//   template <typename Visitor>
//   void fields(Visitor& v, KeyframeOptions& o) {
//     v.number("mean_flow_px", o.mean_flow_px, 0.1, 1000.0);
//     v.flag("every_frame", o.every_frame);
//   }
//   void KeyframeOptions::check() const { check_fields(*this, "keyframes"); }
//   read_fields(yaml, options);                       // strict; finishes the mapping
//   const auto json = json_of_fields(options);
//
// `fields` stands in namespace rugae, where the visitors find it by its argument.

#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/check.h"
#include "core/field.h"
#include "core/units.h"
#include "core/yaml.h"

namespace rugae {

// `place` is where the value stands: the file's line and column, or the struct's name. A NaN is out
// of every range.
template <typename T>
void check_range(const std::string& place, const std::string& key, T value, T low, T high) {
  check(value >= low && value <= high, "{}: {} is {}, expected {} to {}", place, key, value, low,
        high);
}

inline void check_word(const std::string& place, const std::string& key, const std::string& value,
                       const std::vector<std::string>& known) {
  for (const std::string& word : known) {
    if (value == word) return;
  }
  fail("{}: {} '{}' is not known, expected {}{}", place, key, value, fmt::join(known, " or "),
       did_you_mean(value, known));
}

struct FieldChecker {
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
    FieldChecker inner{place + "." + key};
    fields(inner, options);
  }
};

struct FieldReader {
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
      FieldReader inner{std::move(*child)};
      fields(inner, options);
      inner.yaml.finish();
    }
  }
};

struct FieldWriter {
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
    FieldWriter inner;
    fields(inner, options);
    json[key] = std::move(inner.json);
  }
};

struct FieldLister {
  std::string prefix;
  std::vector<Field> list;

  void flag(const std::string& key, bool&) { list.push_back({prefix + key, Field::Kind::flag}); }
  void seed(const std::string& key, std::uint64_t&) {
    list.push_back({prefix + key, Field::Kind::seed});
  }
  template <typename T, typename Bound>
  void number(const std::string& key, T&, Bound low, Bound high) {
    list.push_back({prefix + key,
                    std::is_integral_v<T> ? Field::Kind::whole : Field::Kind::real,
                    static_cast<double>(low),
                    static_cast<double>(high),
                    {}});
  }
  void angle(const std::string& key, double&, double low_rad, double high_rad) {
    list.push_back({prefix + key + "_deg",
                    Field::Kind::real,
                    deg_from_rad(low_rad),
                    deg_from_rad(high_rad),
                    {}});
  }
  template <typename Enum>
  void choice(const std::string& key, Enum&, const std::vector<std::string>& names) {
    list.push_back({prefix + key, Field::Kind::word, 0.0, 0.0, names});
  }
  void word(const std::string& key, std::string&, const std::vector<std::string>& known) {
    list.push_back({prefix + key, Field::Kind::word, 0.0, 0.0, known});
  }
  template <typename Options>
  void section(const std::string& key, Options& options) {
    FieldLister inner{prefix + key + ".", {}};
    fields(inner, options);
    list.insert(list.end(), inner.list.begin(), inner.list.end());
  }
};

/// Throws Error naming `name`, the field, its value and its range.
template <typename Options>
void check_fields(Options options, const char* name) {
  FieldChecker checker{name};
  fields(checker, options);
}

/// Keeps the value of every absent key. Throws Error with file, line and column for an unknown key,
/// a wrong type or a value out of range.
template <typename Options>
void read_fields(YamlReader yaml, Options& options) {
  FieldReader reader{std::move(yaml)};
  fields(reader, options);
  reader.yaml.finish();
}

template <typename Options>
std::vector<Field> list_of_fields(Options options) {
  FieldLister lister;
  fields(lister, options);
  return std::move(lister.list);
}

template <typename Options>
nlohmann::ordered_json json_of_fields(Options options) {
  FieldWriter writer;
  fields(writer, options);
  return std::move(writer.json);
}

}  // namespace rugae
