#pragma once
// The parts of a PNG file.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rugae {

inline constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";

struct PngChunk {
  std::string_view type, data;
};

/// Four bytes from `at` on, the most significant first.
std::uint32_t big_endian(std::string_view bytes, std::size_t at);

/// The chunks of `bytes`, which begin with the signature, to IEND; nothing when they end before it.
/// The views are into `bytes`. Throws Error "NAME: damaged: ..." for a chunk that does not match
/// its checksum.
std::optional<std::vector<PngChunk>> png_chunks(const std::string& name, std::string_view bytes);

}  // namespace rugae
