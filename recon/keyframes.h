#pragma once
// Key frames, the paper's algorithm 2: mean magnitude of the Farneback flow since the last key
// frame.

#include <memory>
#include <vector>

#include "recon/flow.h"
#include "recon/options.h"
#include "recon/preprocess/preprocess.h"

namespace rugae {

struct Keyframes {
  std::vector<int> frames;           // indices, ascending, the first frame included
  std::vector<double> mean_flow_px;  // of each to the one before; 0 for the first
};

/// Frame after frame, as far as they have come.
class KeyframeSelector {
 public:
  KeyframeSelector(const FrameSource& frames, const KeyframeOptions& options);
  ~KeyframeSelector();

  /// Looks at the frames up to before `end` that it has not looked at. Those chosen do not depend
  /// on how many come at a time.
  void advance(int end);
  const Keyframes& keyframes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rugae
