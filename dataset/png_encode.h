#pragma once
// PNG through libdeflate. OpenCV's encoder (libpng over zlib) takes twice the time on frames and
// four times on normals, and writing images is a fifth of a frame's cost.

#include <opencv2/core/mat.hpp>
#include <string>

namespace rugae {

/// The bytes of a PNG file (ISO/IEC 15948) of an 8 or 16 bit image with one channel, or three in
/// OpenCV's order BGR. Lossless; the same bytes on every machine.
/// `stored`: not compressed, for images in which there is nothing to find.
std::string encode_png(const cv::Mat& image, bool stored = false);

}  // namespace rugae
