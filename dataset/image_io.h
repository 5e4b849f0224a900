#pragma once
// Image files, written atomically. 8-bit colour in memory is BGR as OpenCV has it; linear float
// images are RGB.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

namespace rugae {

/// PNG (or JPEG by extension), 8-bit one or three channels (BGR); throws Error naming the file.
void write_image(const std::filesystem::path& file, const cv::Mat& image);
/// 8-bit BGR (CV_8UC3). Throws Error "...: truncated or not an image" for damaged files: a PNG must
/// end with its IEND chunk, a JPEG with its EOI marker.
cv::Mat read_image_bgr(const std::filesystem::path& file);
cv::Mat read_image_gray(const std::filesystem::path& file);

/// Float32 EXR of 1, 2 or 3 channels (Y; x y; x y z), lossless. No time stamps: the same pixels
/// give the same bytes.
void write_exr(const std::filesystem::path& file, const cv::Mat& image);
cv::Mat read_exr(const std::filesystem::path& file);

}  // namespace rugae
