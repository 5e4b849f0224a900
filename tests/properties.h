#pragma once
// Properties of random YAML: what to write, and how to break it.

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/check.h"
#include "core/field.h"

namespace rugae::test {

/// Checks a property for so many cases, the same ones every time.
template <typename Property>
void for_cases(int cases, Property&& property) {
  const testing::TestInfo& info = *testing::UnitTest::GetInstance()->current_test_info();
  rc::detail::TestMetadata metadata;
  metadata.id = std::string(info.test_suite_name()) + "/" + info.name();
  metadata.description = info.name();
  rc::detail::TestParams params;
  params.seed = 1;
  params.maxSuccess = cases;
  const auto result = rc::detail::checkTestable(std::forward<Property>(property), metadata, params);
  if (result.template is<rc::detail::SuccessResult>()) return;
  std::ostringstream text;
  rc::detail::printResultMessage(result, text);
  FAIL() << text.str();
}

inline int whole(int low, int high) {
  // gen::inRange grows with the size; a share of the range does not
  const auto share = *rc::gen::arbitrary<std::uint32_t>();
  return low + static_cast<int>(share % (static_cast<std::uint64_t>(high) - low + 1));
}
inline double real(double low, double high) {
  switch (whole(0, 9)) {
    case 0:
      return low;
    case 1:
      return high;
    default:
      return low + (high - low) * (whole(0, 1 << 20) / 1048576.0);
  }
}
inline bool flip() { return whole(0, 1) == 1; }
template <typename T>
T one_of(const std::vector<T>& list) {
  return list[static_cast<std::size_t>(whole(0, static_cast<int>(list.size()) - 1))];
}
inline std::string text_of(double value) { return fmt::format("{:.17g}", value); }

/// A value of a field within its range.
inline std::string value_of(const Field& field) {
  switch (field.kind) {
    case Field::Kind::flag:
      return flip() ? "true" : "false";
    case Field::Kind::seed:
      return fmt::format("{}", *rc::gen::arbitrary<std::uint64_t>());
    case Field::Kind::whole:
      return fmt::format("{}", whole(static_cast<int>(field.low), static_cast<int>(field.high)));
    case Field::Kind::real:
      return text_of(real(field.low, field.high));
    case Field::Kind::word:
      return one_of(field.words);
  }
  return {};
}

/// A value that a field of this kind refuses: of another type, not a number, or out of range.
inline std::string wrong_value_of(const Field& field) {
  std::vector<std::string> wrong = {"[[1]]", "{a: 1}", "~", "[]", "\"\"", "banana", "\"1 2\""};
  const bool number = field.kind == Field::Kind::whole || field.kind == Field::Kind::real;
  if (field.kind != Field::Kind::word)
    wrong.insert(wrong.end(), {".nan", "-.inf", "1e400", "0.5.5", "- 1", "1e-3x"});
  if (number) wrong.insert(wrong.end(), {"true", ".inf", "1e99", "-1e99"});
  if (field.kind == Field::Kind::whole)
    wrong.insert(wrong.end(), {"0.5", fmt::format("{}", static_cast<long long>(field.low) - 1),
                               fmt::format("{}", static_cast<long long>(field.high) + 1),
                               "99999999999999999999"});
  if (field.kind == Field::Kind::real)
    wrong.insert(wrong.end(),
                 {text_of(std::nextafter(field.low, -1e30) - 1e-9 * (1.0 + std::abs(field.low))),
                  text_of(field.high + 1e-9 * (1.0 + std::abs(field.high)))});
  if (field.kind == Field::Kind::flag) wrong.insert(wrong.end(), {"2", "0.0"});
  if (field.kind == Field::Kind::seed) wrong.insert(wrong.end(), {"-1", "1.5"});
  return one_of(wrong);
}

/// A mapping in one line with some of the fields; `value` gives the text of each.
template <typename Value>
std::string mapping_of(const std::vector<Field>& fields, const Value& value) {
  std::string text = "{", open;  // the section that is open
  for (const Field& field : fields) {
    const std::string given = value(field);
    if (given.empty()) continue;
    const std::size_t dot = field.path.find('.');
    const std::string section = dot == std::string::npos ? "" : field.path.substr(0, dot);
    if (section != open) {
      if (!open.empty()) text += "}, ";
      if (!section.empty()) text += section + ": {";
      open = section;
    }
    text += field.path.substr(dot == std::string::npos ? 0 : dot + 1) + ": " + given + ", ";
  }
  return text + (open.empty() ? "}" : "}}");
}

/// Writes a document again, in one line, with one mistake in it; which one is drawn.
class Breaker {
 public:
  explicit Breaker(const std::string& text) : root_(YAML::Load(text)) {
    count(root_, true);
    at_ = whole(0, places_ - 1);
  }
  std::string broken() {
    places_ = 0;
    return written(root_, true);
  }
  const std::string& mistake() const { return mistake_; }

 private:
  void count(const YAML::Node& node, bool root) {
    if (!root) ++places_;
    if (node.IsMap()) {
      ++places_;
      for (const auto& entry : node) count(entry.second, false);
    } else if (node.IsSequence()) {
      for (const auto& entry : node) count(entry, false);
    }
  }
  std::string made(std::string text) {
    mistake_ = text;
    return text;
  }
  std::string written(const YAML::Node& node, bool root) {
    if (!root && places_++ == at_) return made(instead_of(node));
    if (node.IsSequence()) {
      std::string text = "[";
      for (const auto& entry : node) text += written(entry, false) + ", ";
      return text + "]";
    }
    if (!node.IsMap()) return scalar(node);
    const bool here = places_++ == at_;
    std::string text = "{";
    for (const auto& entry : node)
      text += entry.first.Scalar() + ": " + written(entry.second, false) + ", ";
    if (here) {
      const bool twice = node.size() > 0 && flip();
      text += made((twice ? node.begin()->first.Scalar() : "zz_unknown") + ": 1");
    }
    return text + "}";
  }
  static std::string scalar(const YAML::Node& node) {
    const std::string& text = node.Scalar();
    return node.Tag() == "!" || text.find_first_of(" :,[]{}#'\"&*") != std::string::npos
               ? "\"" + text + "\""
               : text;
  }
  static std::string instead_of(const YAML::Node& node) {
    if (node.IsMap()) return one_of<std::string>({"7", "[1]", "~", "banana", "[{}]"});
    if (node.IsSequence()) return one_of<std::string>({"7", "~", "banana", "[[1]]", "{a: 1}"});
    double number = 0.0;
    if (YAML::convert<double>::decode(node, number))
      return one_of<std::string>({".nan", ".inf", "-.inf", "banana", "[[1]]", "{zz: 1}", "~",
                                  "1e400", "\"1 2\"", "-1e300"});
    return one_of<std::string>({"[[1]]", "{zz: 1}", "~"});
  }

  YAML::Node root_;
  int places_ = 0, at_ = 0;
  std::string mistake_;
};

/// Text that is hardly ever what was meant.
inline std::string junk(const std::string& sound) {
  std::string text;
  switch (whole(0, 4)) {
    case 0:  // cut off
      return sound.substr(0, static_cast<std::size_t>(whole(0, static_cast<int>(sound.size()))));
    case 1:  // bytes
      for (int i = whole(0, 80); i > 0; --i) text += static_cast<char>(whole(0, 255));
      return text;
    case 2:  // of YAML's own characters
      for (int i = whole(1, 60); i > 0; --i)
        text +=
            one_of<std::string>({"{",  "}",  "[",  "]", ":", ",", "&a", "*a", "!", "|",  ">", "- ",
                                 "? ", "\n", "  ", "a", "1", "'", "\"", "#",  "%", "<<", "~"});
      return text;
    case 3: {  // deep
      const std::string open = one_of<std::string>({"[", "{a: ", "- ", "? ", "{[", "&a [", "{? "});
      for (int i = whole(1, 20000); i > 0; --i) text += open;
      return text;
    }
    default: {  // one byte changed
      text = sound;
      if (!text.empty())
        text[static_cast<std::size_t>(whole(0, static_cast<int>(text.size()) - 1))] =
            static_cast<char>(whole(0, 255));
      return text;
    }
  }
}

/// Whether `read` refuses, as it should: with an Error that names `place`. Any other exception
/// fails.
template <typename Read>
bool refuses(const Read& read, const std::string& place, std::string& message) {
  try {
    read();
  } catch (const Error& error) {
    message = error.what();
    return message.find(place) != std::string::npos;
  } catch (const std::exception& error) {
    message = std::string("another exception: ") + error.what();
    return false;
  }
  message = "accepted";
  return false;
}

}  // namespace rugae::test
