#pragma once
// Broken input ends in an Error whose text is one line: the file, the place, what was found, what
// was expected.

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rugae {

/// Broken input or a broken option: the command line prints the text and exits with 2.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The user asked to stop (Ctrl-C): what was finished is on disk; the command line exits with 130.
class Interrupted : public Error {
 public:
  using Error::Error;
};

template <typename... Args>
[[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) {
  throw Error(fmt::format(text, std::forward<Args>(args)...));
}

/// Throws Error with the formatted text unless `condition` holds. Write conditions so that a NaN
/// fails.
template <typename... Args>
void check(bool condition, fmt::format_string<Args...> text, Args&&... args) {
  if (!condition) fail(text, std::forward<Args>(args)...);
}

/// The entry of `known` with the smallest edit distance to `word`; empty if none is near enough
/// (more than half of the word's letters, at least 2, differ).
std::string nearest_name(std::string_view word, const std::vector<std::string>& known);

/// "; did you mean 'x'?" or an empty text: the tail of an error that names an unknown word.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace rugae
