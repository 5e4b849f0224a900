#pragma once
// PNG through libdeflate, the way back from png_encode.h: reconstruction and validation read every
// frame several times, and OpenCV's decoder (libpng over zlib) takes three times as long.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "dataset/png_chunks.h"

namespace rugae {

/// The image of a PNG of 8 or 16 bit gray or RGB without interlacing and transparency, as stored,
/// colours in OpenCV's order BGR. Nothing for other kinds and for damaged data: a general decoder's
/// work.
std::optional<cv::Mat> decode_png(const std::vector<PngChunk>& chunks);

}  // namespace rugae
