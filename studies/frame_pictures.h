#pragma once
// Frames and labels of a cell as pictures, in colours that mean the same in all of them.

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "studies/report_parts.h"

namespace rugae {

/// Whether the cell's dataset has the label (dataset/label_images.h) for the frame.
bool has_label(const CellView& view, const std::string& name, int frame);

class FramePictures {
 public:
  /// The scales of depth and flow are those of `frames` together, so that one far corner does not
  /// take all colours. Keeps a reference to the view.
  FramePictures(const CellView& view, const std::vector<int>& frames);

  /// 8-bit BGR, of the frame's size.
  cv::Mat observation(int frame) const;
  /// Throws Error naming the file where there is no such label.
  cv::Mat label(const std::string& name, int frame) const;

  double nearest_mm() const { return nearest_mm_; }
  double farthest_mm() const { return farthest_mm_; }
  double longest_flow_px() const { return longest_flow_px_; }

 private:
  const CellView& view_;
  double nearest_mm_ = 0.0, farthest_mm_ = 1.0, longest_flow_px_ = 1.0;
};

}  // namespace rugae
