#include "dataset/png_decode.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "core/random.h"
#include "dataset/png_encode.h"

namespace rugae {
namespace {

cv::Mat noise(cv::Size size, int type) {
  cv::Mat image(size, type);
  const std::size_t row_bytes = image.elemSize() * static_cast<std::size_t>(size.width);
  for (int y = 0; y < size.height; ++y)
    for (std::size_t i = 0; i < row_bytes; ++i)
      image.ptr(y)[i] = static_cast<unsigned char>(
          random_words(6, Purpose::test, static_cast<std::uint32_t>(y), i)[0]);
  return image;
}

std::optional<cv::Mat> decoded(const std::string& bytes) {
  const auto chunks = png_chunks("a test", bytes);
  return chunks ? decode_png(*chunks) : std::nullopt;
}

cv::Mat by_libpng(const std::string& bytes) {
  return cv::imdecode(
      cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
      cv::IMREAD_UNCHANGED);
}

void append(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>(value >> shift));
}

void append_chunk(std::string& out, const std::string& type, const std::string& data) {
  append(out, static_cast<std::uint32_t>(data.size()));
  out += type + data;
  append(out, libdeflate_crc32(0, out.data() + out.size() - 4 - data.size(), data.size() + 4));
}

struct Kind {
  char depth = 8, colour = 2, interlaced = 0;
  int bytes_per_pixel = 3;
};

// A file whose rows hold random bytes after the filters 0, 1, ... in turn: whatever image that is.
// The compressed data is cut into two chunks.
std::string file_with_filters(cv::Size size, const Kind& kind, int filters,
                              const std::string& chunk = "") {
  std::string rows;
  for (int y = 0; y < size.height; ++y) {
    rows.push_back(static_cast<char>(y % filters));
    for (int i = 0; i < size.width * kind.bytes_per_pixel; ++i)
      rows.push_back(
          static_cast<char>(random_words(7, Purpose::test, static_cast<std::uint32_t>(y), i)[0]));
  }
  libdeflate_compressor* compressor = libdeflate_alloc_compressor(6);
  std::string packed(libdeflate_zlib_compress_bound(compressor, rows.size()), '\0');
  packed.resize(
      libdeflate_zlib_compress(compressor, rows.data(), rows.size(), packed.data(), packed.size()));
  libdeflate_free_compressor(compressor);
  std::string header;
  append(header, static_cast<std::uint32_t>(size.width));
  append(header, static_cast<std::uint32_t>(size.height));
  header += {kind.depth, kind.colour, 0, 0, kind.interlaced};
  std::string out(kPngSignature);
  append_chunk(out, "IHDR", header);
  if (!chunk.empty()) append_chunk(out, chunk, std::string(6, '\1'));
  append_chunk(out, "IDAT", packed.substr(0, packed.size() / 2));
  append_chunk(out, "IDAT", packed.substr(packed.size() / 2));
  append_chunk(out, "IEND", "");
  return out;
}

TEST(PngDecode, GivesBackWhatWasEncoded) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3})
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 2), cv::Size(64, 48), cv::Size(37, 1)})
      for (const bool stored : {false, true}) {
        const cv::Mat image = noise(size, type);
        const auto back = decoded(encode_png(image, stored));
        ASSERT_TRUE(back && back->type() == type && back->size() == size);
        EXPECT_EQ(cv::norm(*back, image, cv::NORM_INF), 0.0);
      }
}

TEST(PngDecode, EveryFilterIsThatOfLibpng) {
  for (const Kind& kind :
       {Kind{8, 2, 0, 3}, Kind{8, 0, 0, 1}, Kind{16, 2, 0, 6}, Kind{16, 0, 0, 2}})
    for (const cv::Size size : {cv::Size(1, 11), cv::Size(40, 30)}) {
      const std::string bytes = file_with_filters(size, kind, 5);
      const cv::Mat expected = by_libpng(bytes);
      const auto found = decoded(bytes);
      ASSERT_TRUE(found && found->type() == expected.type() && found->size() == expected.size());
      EXPECT_EQ(cv::norm(*found, expected, cv::NORM_INF), 0.0);
    }
}

TEST(PngDecode, LeavesOtherKindsToAnotherDecoder) {
  const cv::Size size(8, 8);
  ASSERT_TRUE(decoded(file_with_filters(size, {}, 5)));
  EXPECT_FALSE(decoded(file_with_filters(size, {8, 2, 1, 3}, 5)));  // interlaced
  EXPECT_FALSE(decoded(file_with_filters(size, {8, 6, 0, 4}, 5)));  // with alpha
  EXPECT_FALSE(decoded(file_with_filters(size, {8, 3, 0, 1}, 5)));  // palette
  EXPECT_FALSE(decoded(file_with_filters(size, {4, 0, 0, 1}, 5)));  // two pixels a byte
  EXPECT_FALSE(decoded(file_with_filters(size, {}, 5, "tRNS")));
}

TEST(PngDecode, RefusesDamage) {
  EXPECT_FALSE(decoded(file_with_filters({8, 8}, {}, 6)));            // no such filter
  EXPECT_FALSE(decoded(file_with_filters({8, 8}, {8, 2, 0, 2}, 5)));  // too little data
  EXPECT_FALSE(decoded(file_with_filters({8, 8}, {8, 2, 0, 4}, 5)));  // too much
  EXPECT_FALSE(decode_png({}));
  std::string huge = file_with_filters({1, 1}, {}, 5);
  const auto chunks = png_chunks("a test", huge);
  std::string header(chunks->at(0).data);
  header.replace(0, 8, "\x00\xff\xff\xff\x00\xff\xff\xff", 8);
  EXPECT_FALSE(decode_png({{"IHDR", header}, chunks->at(1), chunks->at(2)}));
  const std::string whole = file_with_filters({8, 8}, {}, 5);
  EXPECT_FALSE(png_chunks("a test", whole.substr(0, whole.size() - 1)));
}

}  // namespace
}  // namespace rugae
