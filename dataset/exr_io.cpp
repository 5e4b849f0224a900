// OpenEXR through OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/check.h"
#include "core/files.h"
#include "dataset/image_io.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// OpenEXR's own threads only cost time here: frames are written side by side, and uncompressed.
void use_callers_thread() {
  static const bool once = OIIO::attribute("exr_threads", -1);
  (void)once;
}

// The last bits of depth and flow are noise to a compressor: ZIP makes them 5 % smaller in 25 times
// the time, so they are stored as they are.
constexpr const char* kCompression = "none";

std::vector<std::string> channel_names(int channels) {
  if (channels == 1) return {"Y"};
  if (channels == 2) return {"x", "y"};
  return {"x", "y", "z"};
}

const std::vector<std::string> kRgb = {"R", "G", "B"};

OIIO::ImageSpec spec_of(const cv::Mat& image, const std::vector<std::string>& names,
                        OIIO::TypeDesc type) {
  OIIO::ImageSpec spec(image.cols, image.rows, image.channels(), type);
  spec.channelnames = names;
  spec.attribute("compression", kCompression);
  spec.attribute("DateTime", "1970:01:01 00:00:00");  // otherwise the time of writing
  return spec;
}

void write(const fs::path& file, const cv::Mat& image, const std::vector<std::string>& names,
           OIIO::TypeDesc stored = OIIO::TypeDesc::FLOAT) {
  check(file.extension() == ".exr", "{}: expected the extension .exr", file.string());
  check(!image.empty() && image.depth() == CV_32F && image.channels() <= 3,
        "{}: image of type {}, expected float32 of 1 to 3 channels", file.string(),
        image.empty() ? "none" : cv::typeToString(image.type()));
  use_callers_thread();
  std::vector<unsigned char> bytes;
  bytes.reserve(image.total() * image.elemSize() + 16 * static_cast<std::size_t>(image.rows) +
                4096);
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto out = OIIO::ImageOutput::create("memory.exr", &memory);
  check(out != nullptr, "{}: cannot be encoded: {}", file.string(), OIIO::geterror());
  const bool written = out->open("memory.exr", spec_of(image, names, stored)) &&
                       out->write_image(OIIO::TypeDesc::FLOAT, image.data,
                                        static_cast<OIIO::stride_t>(image.elemSize()),
                                        static_cast<OIIO::stride_t>(image.step[0])) &&
                       out->close();
  check(written, "{}: cannot be encoded: {}", file.string(), out->geterror());
  write_atomic(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// `fits` looks at the file's format and channels before its pixels are read.
template <typename Fits>
cv::Mat read_checked(const fs::path& file, Fits&& fits) {
  use_callers_thread();
  const std::string bytes = read_text(file);
  OIIO::Filesystem::IOMemReader memory(const_cast<char*>(bytes.data()), bytes.size());
  const auto in = OIIO::ImageInput::open(file.string(), nullptr, &memory);
  if (!in) {
    OIIO::geterror();  // clears it
    fail("{}: truncated or not an image", file.string());
  }
  const OIIO::ImageSpec spec = in->spec();
  check(std::string_view(in->format_name()) == "openexr", "{}: is {}, expected OpenEXR",
        file.string(), in->format_name());
  fits(spec);
  const int channels = std::min(spec.nchannels, 4);
  cv::Mat image(spec.height, spec.width, CV_MAKETYPE(CV_32F, channels));
  const bool read = in->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, image.data);
  if (!read) in->geterror();
  check(read, "{}: truncated or not an image", file.string());
  return image;
}

}  // namespace

void write_exr(const fs::path& file, const cv::Mat& image) {
  write(file, image, channel_names(image.channels()));
}

void write_radiance(const fs::path& file, const cv::Mat& rgb) {
  check(rgb.type() == CV_32FC3, "{}: radiance must be CV_32FC3", file.string());
  write(file, rgb, kRgb);
}

void write_half_rgb(const fs::path& file, const cv::Mat& rgb) {
  check(rgb.type() == CV_32FC3, "{}: a colour must be CV_32FC3", file.string());
  write(file, rgb, kRgb, OIIO::TypeDesc::HALF);
}

cv::Mat read_rgb_exr(const fs::path& file) {
  return read_checked(file, [&file](const OIIO::ImageSpec& spec) {
    check(spec.channelnames == kRgb, "{}: channels {}, expected R G B", file.string(),
          fmt::join(spec.channelnames, " "));
  });
}

cv::Mat read_exr(const fs::path& file) {
  return read_checked(file, [&file](const OIIO::ImageSpec& spec) {
    check(
        spec.format == OIIO::TypeDesc::FLOAT && spec.channelnames == channel_names(spec.nchannels),
        "{}: channels {} of {} in openexr, expected float32 OpenEXR with Y, or x y, or x y z",
        file.string(), fmt::join(spec.channelnames, " "), spec.format.c_str());
  });
}

cv::Mat read_any_exr(const fs::path& file) {
  return read_checked(file, [](const OIIO::ImageSpec&) {});
}

}  // namespace rugae
