#pragma once
// Do depth, pose and flow of a frame of a dataset agree? The point that a pixel sees is lifted by
// its depth, followed on the wall to the time at which it is seen in the next frame, and must land
// where the flow says. Where it does not, the usual mistakes are undone in turn.

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/pose_track.h"
#include "dataset/layout.h"

namespace rugae {

struct LabelSources;

struct FlowAgreement {
  int index = 0;
  std::size_t samples = 0;  // 0: nothing to compare
  double median_px = -1.0, worst_px = -1.0;
  bool agrees = true;
  std::vector<int> fits;  // the explanations that make it agree, by number
};

/// Labels have the lens's size. Throws Error for poses and walls that cannot be read.
FlowAgreement compare_flow(const LabelSources& in, int index, const cv::Mat& depth_mm,
                           const cv::Mat& flow_px, const cv::Mat& masks);

/// Lines that tell the disagreements, of frames in order: one for each explanation, which is the
/// one that fits most of the frames that no line before has told, and one for those that nothing
/// explains.
std::vector<std::string> tell_disagreements(const DatasetLayout& layout, const PoseTrack& track,
                                            const std::vector<FlowAgreement>& frames);

}  // namespace rugae
