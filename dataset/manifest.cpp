#include "dataset/manifest.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <sstream>

#include "core/check.h"
#include "core/files.h"

namespace rugae {
namespace fs = std::filesystem;

std::vector<std::string> files_below(const fs::path& root, const std::string& except) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.is_directory()) continue;
    std::string path = entry.path().lexically_relative(root).generic_string();
    if (path != except) files.push_back(std::move(path));
  }
  std::ranges::sort(files);
  return files;
}

std::vector<std::string> hashes_of(const fs::path& root, const std::vector<std::string>& files) {
  std::vector<std::string> hashes(files.size());
  tbb::parallel_for(std::size_t{0}, files.size(),
                    [&](std::size_t i) { hashes[i] = sha256_of_file(root / files[i]); });
  return hashes;
}

std::string manifest_text(const std::vector<std::string>& files,
                          const std::vector<std::string>& hashes) {
  std::string text;
  for (std::size_t i = 0; i < files.size(); ++i) text += hashes[i] + "  " + files[i] + "\n";
  return text;
}

std::map<std::string, std::string> read_manifest(const fs::path& file) {
  constexpr std::size_t kHash = 64;
  std::istringstream text(read_text(file));
  std::map<std::string, std::string> hash_of;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    check(line.size() > kHash + 2 && line.compare(kHash, 2, "  ") == 0 &&
              line.find_first_not_of("0123456789abcdef") >= kHash,
          "{}:{}: '{}', expected a SHA-256, two spaces and a path", file.string(), number, line);
    hash_of[line.substr(kHash + 2)] = line.substr(0, kHash);
  }
  return hash_of;
}

bool is_temporary(const fs::path& file) { return file.stem().extension() == ".tmp"; }

}  // namespace rugae
