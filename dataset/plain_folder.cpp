#include "dataset/plain_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/files.h"
#include "dataset/foreign_estimate.h"
#include "dataset/image_io.h"
#include "dataset/observations.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

const std::vector<std::string> kImages = {
    "images", "image", "rgb", "color", "colour", "frames", "img", "left", "observations/frames"};
const std::vector<std::string> kDepth = {"depth", "depths", "depth_maps", "depthmaps",
                                         "truth/depth"};
const std::vector<std::string> kFlow = {"flow",         "flows",        "optical_flow",
                                        "flow_forward", "forward_flow", "truth/flow"};
const std::vector<std::string> kMasks = {"masks", "mask"};
const std::vector<std::string> kPoses = {
    "trajectory.txt", "groundtruth.txt", "poses.txt",           "pose.txt",
    "gt.txt",         "trajectory.tum",  "truth/trajectory.txt"};
const std::vector<std::string> kCalibration = {"calibration.yaml", "camera.yaml", "calib.yaml",
                                               "lens.yaml", "observations/calibration.yaml"};

// What was told (it must be there), or the first of the usual names that is there, or nothing.
fs::path find(const fs::path& root, const fs::path& told, const std::vector<std::string>& names) {
  if (!told.empty()) {
    check(fs::exists(told), "{}: no such file or folder", told.string());
    return told;
  }
  for (const std::string& name : names)
    if (fs::exists(root / name)) return root / name;
  return {};
}

std::vector<fs::path> files_in(const fs::path& folder, const std::vector<std::string>& extensions) {
  if (folder.empty()) return {};
  check(fs::is_directory(folder), "{}: is a file, expected a folder", folder.string());
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && std::ranges::count(extensions, lower_extension(entry.path())))
      files.push_back(entry.path());
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  check(!files.empty(), "{}: no files {} in this folder", folder.string(),
        fmt::join(extensions, ", "));
  return files;
}

// Middlebury's .flo: "PIEH", width, height as 32-bit integers, then u v of every pixel as float32,
// by rows, little-endian (Baker et al. 2011, doi:10.1007/s11263-010-0390-2).
cv::Mat read_flo(const fs::path& file) {
  const std::string bytes = read_text(file);
  std::int32_t size[2] = {};
  constexpr std::size_t kHeader = 12;
  const bool begins = bytes.size() >= kHeader && bytes.starts_with("PIEH");
  if (begins) std::memcpy(size, bytes.data() + 4, sizeof(size));
  constexpr std::int32_t kMost = 1 << 15;
  const bool sane = begins && size[0] > 0 && size[1] > 0 && size[0] <= kMost && size[1] <= kMost;
  check(sane && bytes.size() == kHeader + 8 * static_cast<std::size_t>(size[0]) *
                                              static_cast<std::size_t>(size[1]),
        "{}: truncated or not a flow file", file.string());
  cv::Mat flow(size[1], size[0], CV_32FC2);
  std::memcpy(flow.data, bytes.data() + kHeader, bytes.size() - kHeader);
  constexpr float kUnknown = 1e9f;
  flow.forEach<cv::Vec2f>([](cv::Vec2f& f, const int*) {
    if (!(std::abs(f[0]) < kUnknown) || !(std::abs(f[1]) < kUnknown))
      f = cv::Vec2f::all(std::numeric_limits<float>::quiet_NaN());
  });
  return flow;
}

}  // namespace

PlainFolder PlainFolder::open(const fs::path& root, const PlainFolderOptions& options) {
  check(fs::exists(root), "{}: no such folder", root.string());
  check(fs::is_directory(root), "{}: is a file, expected a folder", root.string());
  check(options.depth_scale >= 0.0 && std::isfinite(options.depth_scale),
        "depth-scale is {}, expected above 0", options.depth_scale);
  PlainFolder folder;
  folder.images = find(root, options.images, kImages);
  check(!folder.images.empty(), "{}: no folder of images (looked for {}); name it with --images",
        root.string(), fmt::join(kImages, ", "));
  folder.depth = find(root, options.depth, kDepth);
  folder.flow = find(root, options.flow, kFlow);
  folder.masks = find(root, options.masks, kMasks);
  folder.poses = find(root, options.poses, kPoses);
  folder.calibration = find(root, options.calibration, kCalibration);
  folder.image_files = files_in(folder.images, {".png", ".jpg", ".jpeg", ".bmp"});
  folder.depth_files = files_in(folder.depth, {".exr", ".png"});
  folder.flow_files = files_in(folder.flow, {".exr", ".flo"});
  folder.mask_files = files_in(folder.masks, {".png"});
  if (options.depth_scale > 0.0) folder.depth_scale = options.depth_scale;
  return folder;
}

cv::Mat PlainFolder::depth_mm(std::size_t index) const {
  return read_foreign_depth_mm(depth_files.at(index), depth_scale);
}

cv::Mat PlainFolder::flow_px(std::size_t index) const {
  const fs::path& file = flow_files.at(index);
  if (lower_extension(file) == ".flo") return read_flo(file);
  const cv::Mat image = read_any_exr(file);
  check(image.channels() >= 2, "{}: {} channel, expected two (x, y)", file.string(),
        image.channels());
  cv::Mat flow(image.size(), CV_32FC2);
  cv::mixChannels(image, flow, {0, 0, 1, 1});
  return flow;
}

}  // namespace rugae
