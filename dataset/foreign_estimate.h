#pragma once
// What other programs estimate: a path as a TUM file, depth as images named by their frames.

#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "dataset/estimate.h"

namespace rugae {

/// The poses of a TUM file (world_from_camera, lengths times `mm_per_unit`), each at the time of a
/// frame to within a twentieth of the time between frames; frames without one are lost. Throws
/// Error for other times, and for two poses of one frame.
Estimate estimate_of_trajectory(const std::filesystem::path& file,
                                const std::vector<double>& times_s, double mm_per_unit);

/// EXR (its first channel) or 16-bit PNG of one channel: CV_32F, values times `mm_per_unit`; 0
/// where a PNG has 0. Throws Error naming the file.
cv::Mat read_foreign_depth_mm(const std::filesystem::path& file, double mm_per_unit);

/// The depth images of a folder by the number in each name ("000012.png", "0012_depth.exr"), which
/// is its frame's. Throws Error naming the folder for none, and the file for a name with no number
/// or several, a frame that there is not, or one that has a file already.
std::map<int, std::filesystem::path> foreign_depth_files(const std::filesystem::path& folder,
                                                         int frames);

}  // namespace rugae
