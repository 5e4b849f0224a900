#pragma once
// Files are read whole, and written to a temporary name and renamed: a reader never meets half a
// file.

#include <filesystem>
#include <string>
#include <string_view>

namespace rugae {

/// The bytes of a file; throws Error naming it when it cannot be read.
std::string read_text(const std::filesystem::path& file);

/// Writes through a temporary neighbour and a rename; throws Error naming the file and the system's
/// reason (full disk, no permission). Parent folders must exist.
void write_atomic(const std::filesystem::path& file, std::string_view bytes);

/// The temporary neighbour that a writer with its own output stream fills before `publish`. It
/// keeps the extension, since codecs choose the format by it: "a/b.exr" -> "a/b.tmp.exr".
std::filesystem::path temporary_for(const std::filesystem::path& file);
/// Renames temporary_for(file) to file.
void publish(const std::filesystem::path& file);

/// Creates the folder and its parents; throws Error when it cannot be created or written to.
void make_folder(const std::filesystem::path& folder);

/// Lower-case hexadecimal SHA-256, as printed by sha256sum.
std::string sha256_of_bytes(std::string_view bytes);
std::string sha256_of_file(const std::filesystem::path& file);

}  // namespace rugae
