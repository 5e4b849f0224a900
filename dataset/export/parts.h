#pragma once
// What the formats are made of.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/files.h"
#include "core/progress.h"
#include "dataset/layout.h"
#include "dataset/truth.h"
#include "dataset/writer.h"

namespace rugae {

struct ExportSource {
  DatasetLayout layout;
  DatasetInfo info;
  Truth truth;
  std::filesystem::path out;
  double depth_per_mm = 0.0;  // 0: as the format has it

  int frames() const { return truth.size(); }
  const Lens& lens() const { return truth.camera().lens; }
  double time_s(int frame) const { return truth.track()[frame].time_s; }
  const Rigid3& world_from_camera(int frame) const {
    return truth.track()[frame].world_from_camera;
  }
};

/// Frames between two steps of the progress line.
constexpr std::size_t kExportLot = 16;

/// Files appear whole, so one that is there from an earlier run is done.
template <typename Write>
void write_once(const std::filesystem::path& file, Write write) {
  if (!std::filesystem::exists(file)) write(file);
}

/// The frame as it is, under another name that gets its extension. Returns the file's name.
std::string copy_frame(const ExportSource& source, int frame, const std::filesystem::path& stem);

/// How depth images say what they say.
struct DepthCode {
  double per_mm = 0.0;     // steps
  bool along_ray = false;  // distance, not z
  double most_mm() const { return 65535.0 / per_mm; }
  std::string text() const;  // for notes
};

/// All frames into the folder `images` of the export, and their depth into depth/ where there is a
/// code for it: CV_16U, rounded; 0 where it is not known, not above 0, or too far. Returns the
/// frames' file names; a note says so where depth was too far.
std::vector<std::string> write_frames(const ExportSource& source, const std::string& images,
                                      const std::optional<DepthCode>& depth, Progress& progress,
                                      std::vector<std::string>& notes);

/// 255 where the field stop lets light through.
cv::Mat stop_mask(const Lens& lens);
/// Some pixel's ray leads to z = 0 or behind.
bool sees_behind(const Lens& lens);

/// Coefficients in OpenCV's order, which other programs took over: k1 k2 p1 p2 k3, or k1 k2 k3 k4
/// of a fisheye.
std::vector<double> opencv_distortion(const Lens& lens);
bool has_distortion(const Lens& lens);

/// Numbers with as few digits as read back to the same ones.
std::string joined(const std::vector<double>& numbers, const std::string& between = " ");

}  // namespace rugae
