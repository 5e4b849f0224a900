#include "validate/wall_seen.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace rugae {
namespace {

constexpr std::size_t kFramesAtOnce = 16;  // whose depth is held

}  // namespace

Visibility wall_seen(const Truth& truth, const std::vector<int>& frames, Progress& progress) {
  Visibility visibility(truth.wall(), {});
  for (std::size_t begin = 0; begin < frames.size(); begin += kFramesAtOnce) {
    const std::size_t end = std::min(frames.size(), begin + kFramesAtOnce);
    std::vector<cv::Mat> depths_mm(end - begin);
    tbb::parallel_for(begin, end,
                      [&](std::size_t i) { depths_mm[i - begin] = truth.depth_mm(frames[i]); });
    for (std::size_t i = begin; i < end; ++i)
      visibility.add(truth.camera().lens, truth.track()[frames[i]].world_from_camera,
                     depths_mm[i - begin]);
    progress.step(end - begin);
  }
  return visibility;
}

}  // namespace rugae
