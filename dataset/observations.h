#pragma once
// What reconstruction may read: frames, times and a calibration. Nothing here can reach the truth.

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "cameras/camera.h"

namespace rugae {

/// Order of file names for people: runs of digits compare as numbers, so "f2.png" is before
/// "f10.png".
bool natural_less(const std::string& a, const std::string& b);

class Observations {
 public:
  /// A dataset's folder (its observations/ part is used), an observations folder itself, or a plain
  /// folder of images (PNG, JPEG, BMP; by natural order of names) together with a calibration file.
  /// `calibration` overrides the dataset's own, which still says how long the rows take and where
  /// the lights are where the other does not. Times come from frames.csv; a plain folder gets index
  /// / `fps`. Throws Error for an empty folder, a missing calibration ("... give one with
  /// --calibration"), images of another size than the lens, rows that take longer than a frame,
  /// fewer than two frames.
  static Observations open(const std::filesystem::path& folder,
                           const std::filesystem::path& calibration = {}, double fps = 30.0);

  /// Frames that are yet to come: makes `folder` an observations folder without frames. Throws
  /// Error where it has some.
  static Observations record(const std::filesystem::path& folder, const Calibration& calibration);
  /// Writes one frame more into the folder, as PNG. Throws Error for an image of another size than
  /// the lens', another type than CV_8UC3, and times that do not ascend or leave no time for the
  /// rows.
  void append(const cv::Mat& bgr, double time_s);

  int size() const { return static_cast<int>(files_.size()); }
  const Lens& lens() const { return lens_; }
  /// Of the middle row.
  double time_s(int index) const { return times_s_[index]; }
  const std::vector<double>& times_s() const { return times_s_; }
  /// From a row to the next below; 0 for a global shutter.
  double row_time_s() const { return row_time_s_; }
  /// Empty where nothing says where they are.
  const std::vector<Emitter>& lights() const { return lights_; }
  const std::filesystem::path& file(int index) const { return files_[index]; }
  /// CV_8UC3, BGR; read from disk at each call (memory does not grow with the number of frames);
  /// checked against the lens' size.
  cv::Mat image(int index) const;
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  std::filesystem::path recording_;  // the folder that append() writes to
  Lens lens_;
  double row_time_s_ = 0.0;
  std::vector<Emitter> lights_;
  std::vector<std::filesystem::path> files_;
  std::vector<double> times_s_;
};

}  // namespace rugae
