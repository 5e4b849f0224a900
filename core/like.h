#pragma once
// Files that build on others: `like: NAME_OR_FILE` takes from that preset or file what the file
// itself does not say.

#include <filesystem>
#include <string>
#include <vector>

#include "core/yaml.h"

namespace rugae {

struct LikeFile {
  std::filesystem::path file;
  YamlReader yaml;  // `like` was asked for
};

/// `file` and those it builds on, to be read over each other: the one that builds on none first,
/// `file` last. A name is that of a preset of `kind` ("scenes"; `what` is "scene"), a path goes
/// from the file in which it stands. Throws Error naming file, line and column of a `like` that
/// leads nowhere or in a circle, and as YamlReader does.
std::vector<LikeFile> read_like_chain(const std::string& kind, const std::string& what,
                                      const std::filesystem::path& file);

}  // namespace rugae
