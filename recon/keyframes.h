#pragma once
// Key frames, the paper's algorithm 2: mean magnitude of the Farneback flow since the last key
// frame.

#include <vector>

#include "core/progress.h"
#include "recon/flow.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

struct Keyframes {
  std::vector<int> frames;           // indices, ascending, the first frame included
  std::vector<double> mean_flow_px;  // of each to the one before; 0 for the first
};

Keyframes select_keyframes(const FrameSource& frames, const KeyframeOptions& options,
                           Progress& progress);

}  // namespace rugae
