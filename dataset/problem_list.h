#pragma once
// What a check finds, one line each, and the checks that folders of every kind share.

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/check.h"
#include "core/pose_track.h"

namespace rugae {

class ProblemList {
 public:
  /// The same line is kept once.
  void note(std::string problem) {
    if (std::ranges::find(problems_, problem) == problems_.end())
      problems_.push_back(std::move(problem));
  }
  /// The result of `action`, or nothing and its error noted, except that of a file that is not
  /// there.
  template <typename Action>
  auto attempt(Action&& action) -> std::optional<decltype(action())> {
    try {
      return action();
    } catch (const Error& error) {
      const std::string text = error.what();
      if (!text.ends_with(": no such file")) note(text);
      return std::nullopt;
    }
  }
  bool none() const { return problems_.empty(); }
  std::vector<std::string> take() { return std::move(problems_); }

 private:
  std::vector<std::string> problems_;
};

/// Files below `root` that its manifest.sha256 lists and are missing, that it does not list, or
/// that were changed.
void check_manifest(const std::filesystem::path& root, ProblemList& problems);

/// A camera that never moves has lost its path.
void check_moves(const PoseTrack& track, const std::string& name, ProblemList& problems);

}  // namespace rugae
