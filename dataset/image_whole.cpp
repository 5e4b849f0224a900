#include "dataset/image_whole.h"

#include <cstdint>

#include "core/check.h"
#include "dataset/png_chunks.h"

namespace rugae {
namespace {

using namespace std::string_view_literals;
constexpr std::string_view kJpegStart = "\xff\xd8\xff"sv;
constexpr std::string_view kJpegScan = "\xff\xda"sv;
constexpr std::string_view kJpegEnd = "\xff\xd9"sv;

std::uint32_t byte_at(std::string_view bytes, std::size_t at) {
  return static_cast<unsigned char>(bytes[at]);
}
std::uint32_t little_endian(std::string_view bytes, std::size_t at) {
  return byte_at(bytes, at) | byte_at(bytes, at + 1) << 8 | byte_at(bytes, at + 2) << 16 |
         byte_at(bytes, at + 3) << 24;
}

// A byte 0xff within a scan's data is always followed by 0 or a restart marker, so an end marker
// behind the last scan marker ends that scan (ITU-T T.81, annex B.1.1).
bool jpeg_is_whole(std::string_view bytes) {
  const std::size_t scan = bytes.rfind(kJpegScan), end = bytes.rfind(kJpegEnd);
  return scan != std::string_view::npos && end != std::string_view::npos && end > scan;
}

// BITMAPFILEHEADER: offset of the pixels at byte 10; BITMAPINFOHEADER: width at 18, height at 22
// (negative: top row first), bits a pixel at 28, compression at 30.
bool bmp_is_whole(std::string_view bytes) {
  constexpr std::size_t kHeaders = 54;
  if (bytes.size() < kHeaders) return false;
  const std::uint64_t offset = little_endian(bytes, 10), width = little_endian(bytes, 18);
  const auto signed_height = static_cast<std::int32_t>(little_endian(bytes, 22));
  const std::uint64_t height = signed_height < 0 ? -static_cast<std::int64_t>(signed_height)
                                                 : static_cast<std::int64_t>(signed_height);
  const std::uint64_t bits = byte_at(bytes, 28) | byte_at(bytes, 29) << 8;
  if (little_endian(bytes, 30) != 0) return little_endian(bytes, 2) <= bytes.size();  // run lengths
  const std::uint64_t row = (width * bits + 31) / 32 * 4;
  return row > 0 && height > 0 && offset <= bytes.size() && height <= (bytes.size() - offset) / row;
}

}  // namespace

void check_image_is_whole(const std::string& name, std::string_view bytes) {
  bool whole = false;
  if (bytes.starts_with(kPngSignature))
    whole = png_chunks(name, bytes).has_value();
  else if (bytes.starts_with(kJpegStart))
    whole = jpeg_is_whole(bytes);
  else if (bytes.starts_with("BM"))
    whole = bmp_is_whole(bytes);
  check(whole, "{}: truncated or not an image", name);
}

}  // namespace rugae
