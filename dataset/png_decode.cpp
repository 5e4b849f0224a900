#include "dataset/png_decode.h"

#include <libdeflate.h>

#include <array>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/check.h"

namespace rugae {
namespace {

constexpr std::uint64_t kLargestImage = std::uint64_t{1} << 30;  // bytes: more is not a frame

enum Filter : unsigned char { kNone, kSub, kUp, kAverage, kPaeth };

struct Header {
  int width = 0, height = 0, bytes_per_sample = 0, channels = 0;
  std::size_t step() const { return static_cast<std::size_t>(channels) * bytes_per_sample; }
  std::size_t row() const { return step() * width; }
  std::size_t rows() const { return (row() + 1) * height; }  // each after its filter
};

// ISO/IEC 15948, section 11.2.2; nothing for what is not read here.
std::optional<Header> header_of(std::string_view data) {
  constexpr std::uint32_t kLargestSide = 1 << 24;
  if (data.size() != 13) return std::nullopt;
  const std::uint32_t width = big_endian(data, 0), height = big_endian(data, 4);
  const char depth = data[8], colour = data[9];
  const bool known = (depth == 8 || depth == 16) && (colour == 0 || colour == 2);
  const bool plain = data[10] == 0 && data[11] == 0 && data[12] == 0;  // not interlaced
  if (!known || !plain || width == 0 || height == 0 || width > kLargestSide ||
      height > kLargestSide)
    return std::nullopt;
  const Header header{static_cast<int>(width), static_cast<int>(height), depth / 8,
                      colour == 0 ? 1 : 3};
  if (static_cast<std::uint64_t>(header.row()) * height > kLargestImage) return std::nullopt;
  return header;
}

bool inflate(std::string_view data, std::vector<unsigned char>& out) {
  struct Free {
    void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
  };
  thread_local const std::unique_ptr<libdeflate_decompressor, Free> decompressor(
      libdeflate_alloc_decompressor());
  check(decompressor != nullptr, "PNG: no memory for the decompressor");
  return libdeflate_zlib_decompress(decompressor.get(), data.data(), data.size(), out.data(),
                                    out.size(), nullptr) == LIBDEFLATE_SUCCESS;
}

// The predictor of Paeth, section 9.4: whichever of left, above and upper left is nearest to
// left + above - upper left.
int paeth(int left, int above, int corner) {
  const int p = left + above - corner;
  const int a = std::abs(p - left), b = std::abs(p - above), c = std::abs(p - corner);
  if (a <= b && a <= c) return left;
  return b <= c ? above : corner;
}

// Section 9.2, in place; `above` is the row before, zeros for the first. `step` is a constant where
// the compiler can use it.
template <typename Step>
bool unfilter(unsigned char filter, unsigned char* row, const unsigned char* above,
              std::size_t bytes, Step step) {
  const std::size_t n = step;
  const auto add = [&](std::size_t i, int predicted) {
    row[i] = static_cast<unsigned char>(row[i] + predicted);
  };
  switch (filter) {
    case kNone:
      return true;
    case kSub: {
      // The pixel to the left stays in registers.
      std::array<unsigned char, 6> left{};
      for (std::size_t i = 0; i < bytes; i += n)
        for (std::size_t k = 0; k < n; ++k) {
          left[k] = static_cast<unsigned char>(left[k] + row[i + k]);
          row[i + k] = left[k];
        }
      return true;
    }
    case kUp:
      for (std::size_t i = 0; i < bytes; ++i) add(i, above[i]);
      return true;
    case kAverage:
      for (std::size_t i = 0; i < n; ++i) add(i, above[i] / 2);
      for (std::size_t i = n; i < bytes; ++i) add(i, (row[i - n] + above[i]) / 2);
      return true;
    case kPaeth:
      for (std::size_t i = 0; i < n; ++i) add(i, above[i]);
      for (std::size_t i = n; i < bytes; ++i) add(i, paeth(row[i - n], above[i], above[i - n]));
      return true;
    default:
      return false;
  }
}

bool unfilter_row(const Header& header, unsigned char* row, const unsigned char* above) {
  constexpr std::integral_constant<std::size_t, 3> kRgb8;
  return header.step() == kRgb8 ? unfilter(row[-1], row, above, header.row(), kRgb8)
                                : unfilter(row[-1], row, above, header.row(), header.step());
}

}  // namespace

std::optional<cv::Mat> decode_png(const std::vector<PngChunk>& chunks) {
  if (chunks.empty() || chunks[0].type != "IHDR") return std::nullopt;
  const std::optional<Header> header = header_of(chunks[0].data);
  if (!header) return std::nullopt;
  std::vector<std::string_view> parts;
  for (const PngChunk& chunk : chunks) {
    if (chunk.type == "IDAT") parts.push_back(chunk.data);
    // A palette that is only a suggestion is no harm; transparency is another kind of image.
    if (chunk.type == "tRNS") return std::nullopt;
  }
  std::string joined;
  if (parts.size() > 1)
    for (const std::string_view part : parts) joined += part;
  std::vector<unsigned char> rows(header->rows());
  if (parts.empty() || !inflate(parts.size() == 1 ? parts[0] : joined, rows)) return std::nullopt;

  const std::vector<unsigned char> zeros(header->row(), 0);
  const unsigned char* above = zeros.data();
  unsigned char* row = rows.data() + 1;
  const int type = CV_MAKETYPE(header->bytes_per_sample == 1 ? CV_8U : CV_16U, header->channels);
  cv::Mat image(header->height, header->width, type);
  for (int y = 0; y < header->height; ++y, row += header->row() + 1) {
    if (!unfilter_row(*header, row, above)) return std::nullopt;
    above = row;
    if (header->bytes_per_sample == 1) {
      std::copy(row, row + header->row(), image.ptr(y));
      continue;
    }
    auto* wide = image.ptr<std::uint16_t>(y);
    for (std::size_t i = 0; i < header->row() / 2; ++i)
      wide[i] = static_cast<std::uint16_t>(row[2 * i] << 8 | row[2 * i + 1]);
  }
  if (header->channels == 3) cv::cvtColor(image, image, cv::COLOR_RGB2BGR);
  return image;
}

}  // namespace rugae
