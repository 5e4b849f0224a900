#pragma once
// The list of a dataset's files with their checksums, in the form that `sha256sum -c` reads.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace rugae {

/// Paths of all files below `root` relative to it, sorted, `except` left out.
std::vector<std::string> files_below(const std::filesystem::path& root, const std::string& except);

/// SHA-256 of each of the files, side by side; the order is kept.
std::vector<std::string> hashes_of(const std::filesystem::path& root,
                                   const std::vector<std::string>& files);

/// "hash  path" a line; throws Error naming file and line when it is not.
std::map<std::string, std::string> read_manifest(const std::filesystem::path& file);
std::string manifest_text(const std::vector<std::string>& files,
                          const std::vector<std::string>& hashes);

/// True for what core/files calls a temporary neighbour: left by a killed run, never a result.
bool is_temporary(const std::filesystem::path& file);

}  // namespace rugae
