#pragma once
// Frames on the grid of the depth maps.

#include <opencv2/core/mat.hpp>

#include "recon/dense/pinhole_grid.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

/// A frame straightened to a wide pinhole and averaged over each of its pixels' area.
struct WideFrame {
  cv::Mat bgr;    // CV_32FC3, levels as the camera gave them
  cv::Mat known;  // CV_8U, 255 where no reflection was detected and the field stop lets light in
};

/// Reads frames straight from the observations: preprocessing straightens them to a smaller field
/// of view and may have painted over their reflections. Safe to use from many threads at once.
class WideFrames {
 public:
  /// `reflections`: how they are detected. Keeps a reference to the frames.
  WideFrames(const FrameSource& frames, const ReflectionOptions& reflections, int width_px);

  const PinholeGrid& grid() const { return grid_; }
  WideFrame read(int index) const;
  /// A key frame whose rows were read one after another, as the camera would have seen it had it
  /// stood still from the frame's time on. `depth`: CV_32F, of the wall at that time, any number of
  /// pixels over the grid's view; where it is wrong by a share, so is what the camera's shift
  /// moved.
  WideFrame read(int index, const CameraMotion& motion, const cv::Mat& depth) const;
  /// 1 / V on the grid, CV_32F: what undoes the vignetting of levels as the camera gave them.
  const cv::Mat& vignetting_gain() const { return gain_; }

 private:
  WideFrame read(int index, const cv::Mat& source) const;
  cv::Mat straightened(const cv::Mat& picture, const cv::Mat& source) const;
  /// Vector through a place of `source_`, z = 1.
  Vec3 ray(int x, int y) const;

  const FrameSource& frames_;
  ReflectionOptions reflections_;
  PinholeGrid grid_;
  int oversampling_ = 1;  // pixels straightened for each pixel of the grid, each way
  cv::Mat source_;        // CV_32FC2: where these come from, OpenCV's pixel convention
  cv::Mat gain_;
};

}  // namespace rugae
