#include "dataset/image_io.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "core/check.h"
#include "core/files.h"
#include "dataset/image_whole.h"
#include "dataset/png_chunks.h"
#include "dataset/png_decode.h"
#include "dataset/png_encode.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

bool is_jpeg(const std::string& extension) { return extension == ".jpg" || extension == ".jpeg"; }
bool is_tiff(const std::string& extension) { return extension == ".tif" || extension == ".tiff"; }

// The PNGs that the flags leave as they are; nothing for others.
std::optional<cv::Mat> decoded_png(const std::string& name, std::string_view bytes, int flags) {
  if (!bytes.starts_with(kPngSignature)) return std::nullopt;
  const auto chunks = png_chunks(name, bytes);
  std::optional<cv::Mat> image = chunks ? decode_png(*chunks) : std::nullopt;
  const bool as_stored = flags == cv::IMREAD_UNCHANGED;
  if (image && !as_stored && image->type() != CV_8UC3) return std::nullopt;
  return image;
}

cv::Mat decode(const fs::path& file, int flags) {
  const std::string bytes = read_text(file);
  if (std::optional<cv::Mat> image = decoded_png(file.string(), bytes, flags)) return *image;
  check_image_is_whole(file.string(), bytes);
  cv::Mat image;
  try {
    image = cv::imdecode(
        cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())), flags);
  } catch (const cv::Exception&) {
    image.release();
  }
  check(!image.empty(), "{}: truncated or not an image", file.string());
  return image;
}

}  // namespace

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool has_image_extension(const fs::path& file) {
  const std::string extension = lower_extension(file);
  return extension == ".png" || extension == ".bmp" || is_jpeg(extension);
}

void write_image(const fs::path& file, const cv::Mat& image, int jpeg_quality) {
  const std::string extension = lower_extension(file);
  check(extension == ".png" || is_jpeg(extension) || is_tiff(extension),
        "{}: images are written as .png, .jpg or .tiff", file.string());
  check(!image.empty(), "{}: the image to write is empty", file.string());
  const bool eight = image.depth() == CV_8U, sixteen = image.depth() == CV_16U;
  check((eight || (sixteen && !is_jpeg(extension))) &&
            (image.channels() == 1 || image.channels() == 3),
        "{}: image of type {}, expected 8-bit (PNG and TIFF also 16-bit) with 1 or 3 channels",
        file.string(), cv::typeToString(image.type()));
  if (extension == ".png") {
    write_atomic(file, encode_png(image));
    return;
  }
  constexpr int kNotCompressed = 1;  // what every reader of TIFF knows
  const std::vector<int> parameters =
      is_jpeg(extension) ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, jpeg_quality}
                         : std::vector<int>{cv::IMWRITE_TIFF_COMPRESSION, kNotCompressed};
  std::vector<unsigned char> bytes;
  bool encoded = false;
  std::string reason;
  try {
    encoded = cv::imencode(extension, image, bytes, parameters);
  } catch (const cv::Exception& error) {
    reason = ": " + error.err;
  }
  check(encoded, "{}: cannot be encoded{}", file.string(), reason);
  write_atomic(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Mat read_image_bgr(const fs::path& file) {
  return decode(file, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
}

cv::Mat read_image_gray(const fs::path& file) {
  cv::Mat image = decode(file, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
  return image;
}

cv::Mat read_image_as_stored(const fs::path& file) { return decode(file, cv::IMREAD_UNCHANGED); }

// n in [-1, 1] -> q = round(32767 n + 32768) in [1, 65535]. Half a step is 1.53e-5 in each
// component, so the direction errs by at most sqrt(3) times that: 2.6e-5 rad.
void write_normals(const fs::path& file, const cv::Mat& normal, bool smooth) {
  check(normal.type() == CV_32FC3, "{}: normals must be CV_32FC3", file.string());
  cv::Mat code(normal.size(), CV_16UC3);
  for (int y = 0; y < normal.rows; ++y) {
    const auto* n = normal.ptr<cv::Vec3f>(y);
    auto* q = code.ptr<cv::Vec3w>(y);
    for (int x = 0; x < normal.cols; ++x)
      for (int c = 0; c < 3; ++c) {
        const float v = n[x][c];  // the comparison is false for NaN
        q[x][2 - c] =
            v >= -1.001f && v <= 1.001f
                ? static_cast<std::uint16_t>(std::clamp(v, -1.f, 1.f) * 32767.f + 32768.5f)
                : std::uint16_t{0};
      }
  }
  check(lower_extension(file) == ".png", "{}: normals are written as .png", file.string());
  write_atomic(file, encode_png(code, smooth));
}

cv::Mat read_normals(const fs::path& file) {
  const cv::Mat code = read_image_as_stored(file);
  check(code.type() == CV_16UC3, "{}: holds {}, expected 16-bit RGB", file.string(),
        cv::typeToString(code.type()));
  cv::Mat normal(code.size(), CV_32FC3);
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (int y = 0; y < normal.rows; ++y) {
    auto* n = normal.ptr<cv::Vec3f>(y);
    const auto* q = code.ptr<cv::Vec3w>(y);
    for (int x = 0; x < normal.cols; ++x) {
      if (q[x][0] == 0 || q[x][1] == 0 || q[x][2] == 0) {
        n[x] = {kNone, kNone, kNone};
        continue;
      }
      const cv::Vec3f v(static_cast<float>(q[x][2]) - 32768.f,
                        static_cast<float>(q[x][1]) - 32768.f,
                        static_cast<float>(q[x][0]) - 32768.f);
      n[x] = v * (1.f / std::sqrt(v.dot(v)));
    }
  }
  return normal;
}

}  // namespace rugae
