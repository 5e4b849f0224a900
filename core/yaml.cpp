#include "core/yaml.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/files.h"
#include "core/units.h"

namespace rugae {

struct YamlReader::State {
  std::string name;
  YAML::Mark mark;
  std::map<std::string, YAML::Node> values;
  std::map<std::string, YAML::Mark> key_marks;
  std::vector<std::string> asked;
};

namespace {

std::string place(const std::string& name, const YAML::Mark& mark) {
  if (mark.is_null()) return name + ":1:1";  // an empty document
  return fmt::format("{}:{}:{}", name, mark.line + 1, mark.column + 1);
}

std::string shown(const YAML::Node& node) {
  if (node.IsScalar()) return "'" + node.Scalar() + "'";
  return node.IsSequence() ? "a list" : node.IsMap() ? "a mapping" : "nothing";
}

template <typename T>
T as(const std::string& name, const std::string& key, const YAML::Node& node,
     const char* expected) {
  T value{};
  if (!node.IsScalar() || !YAML::convert<T>::decode(node, value))
    fail("{}: {} is {}, expected {}", place(name, node.Mark()), key, shown(node), expected);
  return value;
}

double as_number(const std::string& name, const std::string& key, const YAML::Node& node) {
  const double value = as<double>(name, key, node, "a number");
  check(std::isfinite(value), "{}: {} is {}, expected a finite number", place(name, node.Mark()),
        key, shown(node));
  return value;
}

void set_flow_style(YAML::Node node) {
  node.SetStyle(YAML::EmitterStyle::Flow);
  for (const auto& entry : node) set_flow_style(node.IsMap() ? entry.second : YAML::Node(entry));
}

std::string one_line(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  YAML::Node flow = YAML::Clone(node);
  if (!flow.IsNull()) set_flow_style(flow);
  std::string text = YAML::Dump(flow);
  std::ranges::replace(text, '\n', ' ');  // long flows are broken into lines
  return text;
}

template <int N>
void read_vector(const std::string& name, const std::string& key, const YAML::Node& node,
                 Eigen::Matrix<double, N, 1>& value) {
  check(node.IsSequence() && node.size() == N, "{}: {} is {}, expected a list of {} numbers",
        place(name, node.Mark()), key, shown(node), N);
  for (int i = 0; i < N; ++i) value[i] = as_number(name, key, node[i]);
}

}  // namespace

YamlReader::YamlReader(const YAML::Node& node, std::string name)
    : state_(std::make_unique<State>()) {
  state_->name = std::move(name);
  state_->mark = node.Mark();
  check(node.IsMap(), "{}: {}, expected a mapping of keys to values",
        place(state_->name, node.Mark()), shown(node));
  for (const auto& entry : node) {
    check(entry.first.IsScalar(), "{}: a key is {}, expected a text",
          place(state_->name, entry.first.Mark()), shown(entry.first));
    const std::string key = entry.first.Scalar();
    check(!state_->values.contains(key), "{}: key '{}' stands twice",
          place(state_->name, entry.first.Mark()), key);
    state_->values.emplace(key, entry.second);
    state_->key_marks.emplace(key, entry.first.Mark());
  }
}

YamlReader::~YamlReader() = default;
YamlReader::YamlReader(YamlReader&&) noexcept = default;
YamlReader& YamlReader::operator=(YamlReader&&) noexcept = default;
YamlReader::YamlReader(const YamlReader& other) : state_(std::make_unique<State>(*other.state_)) {}

YamlReader YamlReader::from_file(const std::filesystem::path& file) {
  return from_text(read_text(file), file.string());
}

YamlReader YamlReader::from_text(const std::string& text, const std::string& name) {
  try {
    return {YAML::Load(text), name};
  } catch (const YAML::Exception& error) {
    fail("{}: not YAML: {}", place(name, error.mark), error.msg);
  }
}

const YAML::Node* YamlReader::find(const std::string& key) {
  state_->asked.push_back(key);
  const auto it = state_->values.find(key);
  return it == state_->values.end() ? nullptr : &it->second;
}

bool YamlReader::has(const std::string& key) const { return state_->values.contains(key); }

std::vector<std::string> YamlReader::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, mark] : state_->key_marks) names.push_back(key);
  const auto at = [&](const std::string& key) { return state_->key_marks.at(key).pos; };
  std::ranges::sort(names, {}, at);
  return names;
}

bool YamlReader::has_mapping(const std::string& key) const {
  const auto it = state_->values.find(key);
  return it != state_->values.end() && it->second.IsMap();
}

void YamlReader::require_key(const std::string& key) {
  state_->asked.push_back(key);
  if (has(key)) return;
  for (const auto& [present, mark] : state_->key_marks)
    if (nearest_name(present, {key}) == key && std::ranges::count(state_->asked, present) == 0)
      fail("{}: unknown key '{}'; did you mean '{}'?", place(state_->name, mark), present, key);
  fail("{}: key '{}' is missing", place(state_->name, state_->mark), key);
}

void YamlReader::get(const std::string& key, double& value) {
  if (const auto* node = find(key)) value = as_number(state_->name, key, *node);
}
void YamlReader::get(const std::string& key, int& value) {
  if (const auto* node = find(key)) value = as<int>(state_->name, key, *node, "a whole number");
}
void YamlReader::get(const std::string& key, std::uint64_t& value) {
  if (const auto* node = find(key))
    value = as<std::uint64_t>(state_->name, key, *node, "a whole number of at least 0");
}
void YamlReader::get(const std::string& key, bool& value) {
  if (const auto* node = find(key)) value = as<bool>(state_->name, key, *node, "true or false");
}
void YamlReader::get(const std::string& key, std::string& value) {
  if (const auto* node = find(key)) value = as<std::string>(state_->name, key, *node, "a text");
}
void YamlReader::get(const std::string& key, Vec2& value) {
  if (const auto* node = find(key)) read_vector<2>(state_->name, key, *node, value);
}
void YamlReader::get(const std::string& key, Vec3& value) {
  if (const auto* node = find(key)) read_vector<3>(state_->name, key, *node, value);
}
void YamlReader::get(const std::string& key, Vec4& value) {
  if (const auto* node = find(key)) read_vector<4>(state_->name, key, *node, value);
}
void YamlReader::get(const std::string& key, std::vector<double>& value) {
  const auto* node = find(key);
  if (!node) return;
  check(node->IsSequence(), "{}: {} is {}, expected a list of numbers",
        place(state_->name, node->Mark()), key, shown(*node));
  value.clear();
  for (const auto& entry : *node) value.push_back(as_number(state_->name, key, entry));
}
void YamlReader::get(const std::string& key, std::vector<std::string>& value) {
  const auto* node = find(key);
  if (!node) return;
  value.clear();
  if (node->IsScalar()) {
    value.push_back(node->Scalar());
    return;
  }
  check(node->IsSequence(), "{}: {} is {}, expected a list of texts",
        place(state_->name, node->Mark()), key, shown(*node));
  for (const auto& entry : *node)
    value.push_back(as<std::string>(state_->name, key, entry, "a text"));
}
void YamlReader::get(const std::string& key, std::vector<std::uint64_t>& value) {
  const auto* node = find(key);
  if (!node) return;
  const char* expected = "a whole number of at least 0";
  value.clear();
  if (node->IsScalar()) {
    value.push_back(as<std::uint64_t>(state_->name, key, *node, expected));
    return;
  }
  check(node->IsSequence(), "{}: {} is {}, expected a list of whole numbers",
        place(state_->name, node->Mark()), key, shown(*node));
  for (const auto& entry : *node)
    value.push_back(as<std::uint64_t>(state_->name, key, entry, expected));
}
void YamlReader::get_deg(const std::string& key, double& value_rad) {
  if (const auto* node = find(key)) value_rad = rad_from_deg(as_number(state_->name, key, *node));
}

void YamlReader::get_choice(const std::string& key, const std::vector<std::string>& names,
                            int& value) {
  const auto* node = find(key);
  if (!node) return;
  const auto word = as<std::string>(state_->name, key, *node, "a name");
  const auto it = std::ranges::find(names, word);
  check(it != names.end(), "{}: {} is '{}', expected one of: {}{}",
        place(state_->name, node->Mark()), key, word, fmt::join(names, ", "),
        did_you_mean(word, names));
  value = static_cast<int>(it - names.begin());
}

std::string YamlReader::text(const std::string& key) {
  const auto* node = find(key);
  return node ? one_line(*node) : std::string();
}

std::vector<std::string> YamlReader::texts(const std::string& key) {
  std::vector<std::string> list;
  const auto* node = find(key);
  if (!node) return list;
  check(node->IsSequence(), "{}: {} is {}, expected a list", place(state_->name, node->Mark()), key,
        shown(*node));
  for (const auto& entry : *node) list.push_back(one_line(entry));
  return list;
}

std::optional<YamlReader> YamlReader::child(const std::string& key) {
  const auto* node = find(key);
  if (!node) return std::nullopt;
  return YamlReader(*node, state_->name);
}

std::vector<YamlReader> YamlReader::children(const std::string& key) {
  std::vector<YamlReader> list;
  const auto* node = find(key);
  if (!node) return list;
  check(node->IsSequence(), "{}: {} is {}, expected a list", place(state_->name, node->Mark()), key,
        shown(*node));
  for (const auto& entry : *node) list.push_back(YamlReader(entry, state_->name));
  return list;
}

std::string YamlReader::where(const std::string& key) const {
  const auto it = state_->values.find(key);
  return place(state_->name, it == state_->values.end() ? state_->mark : it->second.Mark());
}

void YamlReader::finish() const {
  for (const auto& [key, mark] : state_->key_marks)
    check(std::ranges::count(state_->asked, key) > 0, "{}: unknown key '{}'{}",
          place(state_->name, mark), key, did_you_mean(key, state_->asked));
}

std::string yaml_with(const std::string& text, const std::string& path, const std::string& value) {
  YAML::Node root = YAML::Load(text);
  YAML::Node at = root;  // refers to the same document
  for (std::size_t begin = 0;;) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const std::string key = path.substr(begin, end - begin);
    check(!key.empty(), "'{}' is not a path of keys", path);
    check(!at.IsDefined() || at.IsNull() || at.IsMap(), "'{}' is {}, expected a mapping",
          path.substr(0, begin > 0 ? begin - 1 : 0), shown(at));
    YAML::Node next = at[key];
    if (end == path.size()) {
      if (value.starts_with('{') || value.starts_with('['))
        next = YAML::Load(value);
      else
        next = value;
      return YAML::Dump(root);
    }
    at.reset(next);
    begin = end + 1;
  }
}

}  // namespace rugae
