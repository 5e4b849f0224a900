#include "dataset/png_encode.h"

#include <libdeflate.h>

#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/check.h"

namespace rugae {
namespace {

constexpr int kLevel = 1;  // sensor noise leaves little for a longer search to find

void append_big_endian(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(value >> shift));
}

// Length, type, data, and the CRC of type and data.
void append_chunk(std::string& out, const char* type, const std::string& data) {
  append_big_endian(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  out += type;
  out += data;
  append_big_endian(out, libdeflate_crc32(0, out.data() + begin, out.size() - begin));
}

std::string header(const cv::Mat& image) {
  constexpr char kGray = 0, kRgb = 2;
  std::string data;
  append_big_endian(data, static_cast<std::uint32_t>(image.cols));
  append_big_endian(data, static_cast<std::uint32_t>(image.rows));
  data.push_back(image.depth() == CV_8U ? 8 : 16);
  data.push_back(image.channels() == 1 ? kGray : kRgb);
  data.append(3, '\0');  // deflate, the five filters, not interlaced
  return data;
}

// Each row after the number of its filter. Differences to the left neighbour (filter 1) suit noisy
// colour; masks and 16-bit normals, whose flat stretches repeat, come out smaller as they are.
std::vector<unsigned char> rows_of(const cv::Mat& image) {
  const bool wide = image.depth() == CV_16U, colour = image.channels() == 3;
  const int filter = colour && !wide ? 1 : 0;
  const std::size_t row_bytes = image.elemSize() * static_cast<std::size_t>(image.cols);
  std::vector<unsigned char> out((row_bytes + 1) * static_cast<std::size_t>(image.rows));
  cv::Mat rgb;
  if (colour)
    cv::cvtColor(image, rgb, cv::COLOR_BGR2RGB);
  else
    rgb = image;
  unsigned char* to = out.data();
  for (int y = 0; y < rgb.rows; ++y) {
    *to++ = static_cast<unsigned char>(filter);
    if (wide) {
      const auto* from = rgb.ptr<std::uint16_t>(y);
      for (std::size_t i = 0; i < row_bytes / 2; ++i, to += 2) {
        to[0] = static_cast<unsigned char>(from[i] >> 8);
        to[1] = static_cast<unsigned char>(from[i]);
      }
      continue;
    }
    const unsigned char* from = rgb.ptr(y);
    const std::size_t step = filter == 1 ? image.elemSize() : row_bytes;
    std::copy(from, from + std::min(step, row_bytes), to);
    for (std::size_t i = step; i < row_bytes; ++i)
      to[i] = static_cast<unsigned char>(from[i] - from[i - step]);
    to += row_bytes;
  }
  return out;
}

template <int level>
std::string deflated(const std::vector<unsigned char>& bytes) {
  struct Free {
    void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
  };
  thread_local const std::unique_ptr<libdeflate_compressor, Free> compressor(
      libdeflate_alloc_compressor(level));
  check(compressor != nullptr, "PNG: no memory for the compressor");
  std::string out(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  out.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), out.data(),
                                      out.size()));
  return out;
}

}  // namespace

std::string encode_png(const cv::Mat& image, bool stored) {
  check(!image.empty() && (image.depth() == CV_8U || image.depth() == CV_16U) &&
            (image.channels() == 1 || image.channels() == 3),
        "PNG: image of type {}, expected 8 or 16 bit with 1 or 3 channels",
        image.empty() ? "none" : cv::typeToString(image.type()));
  std::string out = "\x89PNG\r\n\x1a\n";
  append_chunk(out, "IHDR", header(image));
  append_chunk(out, "IDAT",
               stored ? deflated<0>(rows_of(image)) : deflated<kLevel>(rows_of(image)));
  append_chunk(out, "IEND", "");
  return out;
}

}  // namespace rugae
