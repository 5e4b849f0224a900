#include "dataset/png_chunks.h"

#include <libdeflate.h>

#include "core/check.h"

namespace rugae {

std::uint32_t big_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

// A PNG is a signature and chunks of length, type, data, CRC-32 of type and data; the last is IEND
// (ISO/IEC 15948, section 5).
std::optional<std::vector<PngChunk>> png_chunks(const std::string& name, std::string_view bytes) {
  constexpr std::size_t kFrame = 12;  // length, type and checksum of a chunk
  std::vector<PngChunk> chunks;
  std::size_t at = kPngSignature.size();
  while (at + kFrame <= bytes.size()) {
    const std::size_t length = big_endian(bytes, at);
    if (length > bytes.size() - at - kFrame) return std::nullopt;
    const PngChunk chunk{bytes.substr(at + 4, 4), bytes.substr(at + 8, length)};
    const auto crc = libdeflate_crc32(0, chunk.type.data(), length + 4);
    check(crc == big_endian(bytes, at + 8 + length),
          "{}: damaged: the checksum of its {} chunk at byte {} does not match", name, chunk.type,
          at);
    chunks.push_back(chunk);
    if (chunk.type == "IEND") return chunks;
    at += kFrame + length;
  }
  return std::nullopt;
}

}  // namespace rugae
