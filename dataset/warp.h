#pragma once
// Pixels of one frame led to another by depth and pose, and how far what is found there differs.

#include <array>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "core/rigid3.h"

namespace rugae {

/// A sequence as the checks see it, wherever its files lie. Frames are read at every call; the
/// readers throw Error for files that cannot be read.
struct WarpSequence {
  Lens lens;
  std::vector<Rigid3> world_from_camera;      // one a frame
  std::function<cv::Mat(int)> read_gray;      // CV_8U
  std::function<cv::Mat(int)> read_depth_mm;  // CV_32F; not finite or not positive: unknown
  std::function<cv::Mat(int)> read_flow_px;   // CV_32FC2, empty when there is no flow

  int size() const { return static_cast<int>(world_from_camera.size()); }
};

enum class DepthKind { z, range };

/// Small patches on a regular grid over the image, with the rays of their pixels.
class WarpGrid {
 public:
  explicit WarpGrid(const Lens& lens);
  std::size_t patches() const { return patches_.size(); }

  /// Share of the patches' centres that have depth and land inside the other frame, 0 to 1, and how
  /// far they move, px, in the median; 0 and 0 where none does.
  struct Landing {
    double share = 0.0, median_px = 0.0;
  };
  Landing landing(const cv::Mat& depth_mm, const Rigid3& other_from_this) const;

  /// |depth found - depth expected| over the depth expected, at the centres of all patches that
  /// land on a smooth part of the other frame's depth.
  std::vector<double> depth_shares(const cv::Mat& depth_mm, const cv::Mat& other_depth_mm,
                                   const Rigid3& other_from_this,
                                   DepthKind kind = DepthKind::z) const;

  /// |pixel led to - (pixel + flow)|, px, at the centres of all patches with depth and flow.
  std::vector<double> flow_errors_px(const cv::Mat& depth_mm, const cv::Mat& flow_px,
                                     const Rigid3& next_from_this,
                                     DepthKind kind = DepthKind::z) const;

  /// 1 - correlation of each textured patch with what is found where it is led to, 0 to 2. The
  /// correlation is free of a patch's mean and contrast, so light that falls off with distance and
  /// angle, and exposure, do not matter (zero-mean normalised cross-correlation). Images are
  /// smoothed() ones.
  std::vector<double> colour_errors(const cv::Mat& image, const cv::Mat& depth_mm,
                                    const cv::Mat& other_image, const Rigid3& other_from_this,
                                    DepthKind kind = DepthKind::z) const;

  /// CV_32F, noise of single pixels smoothed away.
  static cv::Mat smoothed(const cv::Mat& gray);

 private:
  struct Pixel {
    int x = 0, y = 0;
    Vec3 ray = Vec3::Zero();
  };
  static constexpr int kAcross = 5;  // pixels of a patch
  using Patch = std::array<Pixel, kAcross * kAcross>;
  static const Pixel& centre(const Patch& patch) { return patch[kAcross * kAcross / 2]; }
  std::optional<Vec2> lead(const Pixel& pixel, const cv::Mat& depth_mm,
                           const Rigid3& other_from_this, DepthKind kind, double* z_mm) const;

  Lens lens_;
  LensProjector projector_;
  std::vector<Patch> patches_;
};

/// The middle of the values, infinite where there is none or where it is not a number.
double median_of(std::vector<double> values);

}  // namespace rugae
