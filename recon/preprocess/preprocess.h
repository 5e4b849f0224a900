#pragma once
// The paper's section 2.1, frame by frame: reflections, undistortion, de-vignetting.

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "dataset/observations.h"
#include "recon/options.h"
#include "recon/rolling_shutter.h"

namespace rugae {

/// A frame as the stages after preprocessing see it. All images are on the pixel grid of
/// `FrameSource::lens()`, a pinhole.
struct Frame {
  int index = -1;
  cv::Mat gray;        // CV_8U, for pose
  cv::Mat map_bgr;     // CV_8UC3, for the map
  cv::Mat reflection;  // CV_8U, 255 where a reflection was detected
  cv::Mat valid;       // CV_8U, 255 where there was an original pixel that sees
};

/// The frames of a sequence from which the vignetting profile is estimated: sixteen, spread evenly.
std::vector<int> vignetting_frames(int size);

/// Reads and preprocesses frames on demand and holds the latest: up to kMostHeldBytes of what poses
/// are made of, however many frames there are. Images are shared with the caller, who leaves them
/// as they are. Calls are thread-safe. De-vignetting: the profile is estimated once, from frames
/// spread over the sequence; without frames there is none.
class FrameSource {
 public:
  /// Seventeen hundred frames of 640 x 480.
  static constexpr std::size_t kMostHeldBytes = 600'000'000;

  FrameSource(const Observations& observations, const PreprocessOptions& options);
  ~FrameSource();

  /// One frame more, of observations that are being recorded (Observations::append). Not while
  /// other calls run.
  void append(const cv::Mat& bgr, double time_s);

  int size() const;
  /// The lens of the preprocessed frames: the observations' lens without distortion (as it is when
  /// undistortion is off).
  const Lens& lens() const;
  const Observations& observations() const;
  /// Which row of the sensor each place of the preprocessed frames comes from, and when it was
  /// read.
  const RollingShutter& shutter() const;
  /// CV_8U, on the grid of the observations: 255 inside the field stop.
  const cv::Mat& field() const;
  /// Frame::valid, the same for all frames.
  const cv::Mat& valid() const;
  Frame frame(int index) const;
  /// Without `map_bgr` (it is empty): what alignment needs. Painting the reflections over for the
  /// map takes longer than everything else here.
  Frame pose_frame(int index) const;
  /// Only `map_bgr` and `valid`: what mosaics are made of.
  Frame map_frame(int index) const;
  /// Only `gray`: what key frame selection needs.
  cv::Mat gray(int index) const;
  /// Forgets the images that are held: the path is known, and what comes needs the memory.
  void release() const;
  /// B(r): the estimated vignetting profile, V at r = 0 .. 1 in equal steps (1 = half the
  /// diagonal); empty when switched off.
  const std::vector<double>& vignetting_profile() const;

 private:
  void check_index(int index) const;  // throws Error

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rugae
