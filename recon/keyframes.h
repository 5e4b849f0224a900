#pragma once
// Key frames, the paper's algorithm 2: mean magnitude of the Farneback flow since the last key
// frame.

#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/progress.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

/// Farneback flow (CV_32FC2, px) from `reference` to `moving` (CV_8U); `initial` may hold a first
/// guess.
cv::Mat farneback_flow(const cv::Mat& reference, const cv::Mat& moving,
                       const cv::Mat& initial = {});

struct Keyframes {
  std::vector<int> frames;           // indices, ascending, the first frame included
  std::vector<double> mean_flow_px;  // of each to the one before; 0 for the first
};

Keyframes select_keyframes(const FrameSource& frames, const KeyframeOptions& options,
                           Progress& progress);

}  // namespace rugae
