// OpenEXR through OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <memory>
#include <numeric>
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

OIIO::ImageSpec spec_of(const cv::Mat& image) {
  OIIO::ImageSpec spec(image.cols, image.rows, image.channels(), OIIO::TypeDesc::FLOAT);
  if (image.channels() == 1) spec.channelnames = {"Y"};
  if (image.channels() == 2) spec.channelnames = {"x", "y"};
  if (image.channels() == 3) spec.channelnames = {"x", "y", "z"};
  spec.attribute("compression", kCompression);
  spec.attribute("DateTime", "1970:01:01 00:00:00");  // otherwise the time of writing
  return spec;
}

// OpenImageIO brings channels into an order of its own (it takes a y for luminance and a z for
// depth); ours is x y z.
cv::Mat in_order_of_names(const cv::Mat& image, const std::vector<std::string>& names) {
  if (std::ranges::is_sorted(names)) return image;
  std::vector<int> order(names.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&names](int channel) { return names[channel]; });
  cv::Mat sorted(image.size(), image.type());
  std::vector<int> pairs;
  for (std::size_t to = 0; to < order.size(); ++to) {
    pairs.push_back(order[to]);
    pairs.push_back(static_cast<int>(to));
  }
  cv::mixChannels(&image, 1, &sorted, 1, pairs.data(), order.size());
  return sorted;
}

}  // namespace

void write_exr(const fs::path& file, const cv::Mat& image) {
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
  const bool written = out->open("memory.exr", spec_of(image)) &&
                       out->write_image(OIIO::TypeDesc::FLOAT, image.data,
                                        static_cast<OIIO::stride_t>(image.elemSize()),
                                        static_cast<OIIO::stride_t>(image.step[0])) &&
                       out->close();
  check(written, "{}: cannot be encoded: {}", file.string(), out->geterror());
  write_atomic(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Mat read_exr(const fs::path& file) {
  use_callers_thread();
  const std::string bytes = read_text(file);
  OIIO::Filesystem::IOMemReader memory(const_cast<char*>(bytes.data()), bytes.size());
  const auto in = OIIO::ImageInput::open(file.string(), nullptr, &memory);
  if (!in) {
    OIIO::geterror();  // clears it
    fail("{}: truncated or not an image", file.string());
  }
  const OIIO::ImageSpec spec = in->spec();
  check(std::string_view(in->format_name()) == "openexr" && spec.format == OIIO::TypeDesc::FLOAT &&
            spec.nchannels >= 1 && spec.nchannels <= 3,
        "{}: {} channels of {} in {}, expected float32 OpenEXR of 1 to 3 channels", file.string(),
        spec.nchannels, spec.format.c_str(), in->format_name());
  cv::Mat image(spec.height, spec.width, CV_MAKETYPE(CV_32F, spec.nchannels));
  const bool read = in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.data);
  if (!read) in->geterror();
  check(read, "{}: truncated or not an image", file.string());
  return in_order_of_names(image, spec.channelnames);
}

}  // namespace rugae
