#pragma once
// Image files, written atomically. 8-bit colour in memory is BGR as OpenCV has it; linear float
// images are RGB. The same pixels always give the same bytes: no time stamps, no names of hosts.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

namespace rugae {

/// PNG (or by extension JPEG, `jpeg_quality` 1 to 100, or TIFF, not compressed), 8-bit one or three
/// channels (BGR); PNG and TIFF also 16-bit. Throws Error naming the file.
void write_image(const std::filesystem::path& file, const cv::Mat& image, int jpeg_quality = 95);
/// 8-bit BGR (CV_8UC3), on the file's own pixel grid (orientation tags are not applied). Throws
/// Error "...: truncated or not an image" for damaged files: a PNG must be whole to its IEND chunk,
/// a JPEG must end its last scan with an EOI marker, a BMP must have all its rows; "...: damaged:
/// ..." when a PNG chunk does not match its checksum.
cv::Mat read_image_bgr(const std::filesystem::path& file);
/// CV_8U; colour is weighted as OpenCV's BGR2GRAY does (ITU-R BT.601).
cv::Mat read_image_gray(const std::filesystem::path& file);
/// Depth and channels as stored: for masks and 16-bit images.
cv::Mat read_image_as_stored(const std::filesystem::path& file);
/// "PNG" and "png" are one: the extension in lower case, with its dot.
std::string lower_extension(const std::filesystem::path& file);
/// True for the extensions read as images: png, jpg, jpeg, bmp, in any case.
bool has_image_extension(const std::filesystem::path& file);

/// Float32 EXR of 1, 2 or 3 channels (Y; x y; x y z), lossless. No time stamps: the same pixels
/// give the same bytes.
void write_exr(const std::filesystem::path& file, const cv::Mat& image);
/// Float32 EXR with channels R G B, from CV_32FC3 in RGB.
void write_radiance(const std::filesystem::path& file, const cv::Mat& rgb);
/// The same in float16: 11 bits, for values that need no more.
void write_half_rgb(const std::filesystem::path& file, const cv::Mat& rgb);
/// CV_32FC3, RGB, from a file that either of the two wrote. Throws Error as above.
cv::Mat read_rgb_exr(const std::filesystem::path& file);
/// CV_32F of as many channels as the file has. Throws Error as above.
cv::Mat read_exr(const std::filesystem::path& file);
/// Any OpenEXR file that others wrote: CV_32F of its first channels (four at most), whatever their
/// names and precision.
cv::Mat read_any_exr(const std::filesystem::path& file);

/// Unit normals (CV_32FC3, NaN where there is none) as a 16-bit PNG: red, green, blue hold round(
/// 32767 n + 32768 ) of x, y, z; all zero where there is no normal. The direction is kept to 0.0016
/// degrees.
/// Normals that are a number of their own in every pixel (`smooth`) are stored without compression,
/// which would take four times as long for 2 %.
void write_normals(const std::filesystem::path& file, const cv::Mat& normal, bool smooth = false);
/// The same, normalised again after reading.
cv::Mat read_normals(const std::filesystem::path& file);

}  // namespace rugae
