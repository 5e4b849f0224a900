#pragma once
// Which frames of a sequence to lead to which, and their images at hand.

#include <functional>
#include <list>
#include <utility>
#include <vector>

#include "dataset/warp.h"

namespace rugae {

struct FramePair {
  int from = 0, to = 0;
};

/// About a dozen pairs of frames `gap` apart, spread over the sequence.
std::vector<FramePair> spread_pairs(int frames, int gap);

/// About two dozen pairs that see the same wall and whose motion differs most, in pixels, from that
/// of the pair one frame later and one frame before: a shift by one frame shows best there. Both
/// neighbours of both frames exist.
std::vector<FramePair> telling_pairs(const WarpSequence& sequence, const WarpGrid& grid,
                                     const std::function<Rigid3(const Rigid3&)>& pose,
                                     double depth_mm);

/// The last frames that were read, so that neighbouring pairs read each file once.
class FrameCache {
 public:
  explicit FrameCache(const WarpSequence& sequence) : sequence_(sequence) {}
  cv::Mat image(int frame);  // smoothed
  cv::Mat depth_mm(int frame);
  cv::Mat flow_px(int frame);
  /// The median depth of some frames.
  double middle_depth_mm();

 private:
  using Kept = std::list<std::pair<int, cv::Mat>>;
  template <typename Read>
  static cv::Mat find(Kept& kept, int frame, Read&& read);

  const WarpSequence& sequence_;
  Kept images_, depths_, flows_;
};

}  // namespace rugae
