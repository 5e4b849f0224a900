#include "recon/preprocess/packed_mask.h"

#include <algorithm>
#include <array>

#include "core/check.h"

namespace rugae {
namespace {

constexpr int kPixels = 8;  // a byte

// The pixels of every byte.
std::array<std::array<unsigned char, kPixels>, 256> pixels_of_bytes() {
  std::array<std::array<unsigned char, kPixels>, 256> pixels{};
  for (std::size_t byte = 0; byte < pixels.size(); ++byte)
    for (std::size_t k = 0; k < kPixels; ++k) pixels[byte][k] = byte >> k & 1 ? 255 : 0;
  return pixels;
}

}  // namespace

cv::Mat packed_mask(const cv::Mat& mask) {
  check(mask.type() == CV_8UC1, "packed_mask: a picture of {}, expected CV_8UC1",
        cv::typeToString(mask.type()));
  cv::Mat packed(mask.rows, (mask.cols + kPixels - 1) / kPixels, CV_8U, cv::Scalar(0));
  for (int y = 0; y < mask.rows; ++y) {
    const auto* from = mask.ptr<unsigned char>(y);
    auto* to = packed.ptr<unsigned char>(y);
    for (int x = 0; x < mask.cols; ++x)
      to[x / kPixels] =
          static_cast<unsigned char>(to[x / kPixels] | (from[x] != 0 ? 1 : 0) << x % kPixels);
  }
  return packed;
}

cv::Mat unpacked_mask(const cv::Mat& packed, int cols) {
  static const auto kPixelsOf = pixels_of_bytes();
  check(packed.type() == CV_8UC1 && packed.cols == (cols + kPixels - 1) / kPixels,
        "unpacked_mask: {} bytes a row for {} pixels", packed.cols, cols);
  cv::Mat mask(packed.rows, cols, CV_8U);
  for (int y = 0; y < packed.rows; ++y) {
    const auto* from = packed.ptr<unsigned char>(y);
    auto* to = mask.ptr<unsigned char>(y);
    for (int x = 0; x < cols; x += kPixels)
      std::copy_n(kPixelsOf[from[x / kPixels]].begin(), std::min(kPixels, cols - x), to + x);
  }
  return mask;
}

}  // namespace rugae
