#pragma once
// A folder of images, depth, poses and the like that somebody else made.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace rugae {

/// Where the parts lie; what is empty is looked for by its usual names below `root`.
struct PlainFolderOptions {
  std::filesystem::path images, depth, flow, masks;  // folders
  std::filesystem::path poses, calibration;          // files
  double depth_scale = 0.0;  // mm per unit of the depth files; 0: 1 (they are in millimetres)
};

struct PlainFolder {
  std::filesystem::path images, depth, flow, masks;  // empty where there are none
  std::filesystem::path poses, calibration;
  std::vector<std::filesystem::path> image_files, depth_files, flow_files, mask_files;
  double depth_scale = 1.0;

  /// Files by natural order of their names: images PNG, JPEG or BMP; depth EXR or PNG; flow EXR or
  /// .flo; masks PNG. Throws Error when there is no folder of images, or something named in the
  /// options is not there.
  static PlainFolder open(const std::filesystem::path& root, const PlainFolderOptions& options);

  /// CV_32F, mm; 0 where a PNG has 0. Throws Error naming the file: not an image, more channels
  /// than a depth has, or of 8 bits.
  cv::Mat depth_mm(std::size_t index) const;
  /// CV_32FC2, px; not a number where unknown (.flo: above 1e9).
  cv::Mat flow_px(std::size_t index) const;
};

}  // namespace rugae
