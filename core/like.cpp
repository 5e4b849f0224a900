#include "core/like.h"

#include <algorithm>

#include "core/check.h"
#include "core/presets.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// A preset's name, or a path from the folder of the file that says it (an absolute one stays
// itself).
fs::path find_like(const std::string& kind, const std::string& what, const std::string& like,
                   const LikeFile& from) {
  const bool path = fs::path(like).has_extension() || like.find('/') != std::string::npos;
  try {
    return find_preset(kind, what, path ? (from.file.parent_path() / like).string() : like);
  } catch (const Error& error) {
    fail("{}: like: {}", from.yaml.where("like"), error.what());
  }
}

}  // namespace

std::vector<LikeFile> read_like_chain(const std::string& kind, const std::string& what,
                                      const fs::path& file) {
  std::vector<LikeFile> chain;
  std::vector<fs::path> seen;
  for (fs::path next = file; !next.empty();) {
    LikeFile& at = chain.emplace_back(LikeFile{next, YamlReader::from_file(next)});
    seen.push_back(fs::weakly_canonical(next));
    std::string like;
    at.yaml.get("like", like);
    if (like.empty()) break;
    next = find_like(kind, what, like, at);
    check(std::ranges::count(seen, fs::weakly_canonical(next)) == 0, "{}: like goes in a circle",
          at.yaml.where("like"));
  }
  std::ranges::reverse(chain);
  return chain;
}

}  // namespace rugae
