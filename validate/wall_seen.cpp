#include "validate/wall_seen.h"

#include "core/in_lots.h"

namespace rugae {
namespace {

constexpr std::size_t kFramesAtOnce = 16;  // whose depth is held

}  // namespace

Visibility wall_seen(const Truth& truth, const std::vector<int>& frames, Progress& progress) {
  Visibility visibility(truth.wall(), {});
  make_in_lots(
      frames.size(), kFramesAtOnce, progress,
      [&](std::size_t i) { return truth.depth_mm(frames[i]); },
      [&](std::size_t i, const cv::Mat& depth_mm) {
        visibility.add(truth.camera().lens, truth.track()[frames[i]].world_from_camera, depth_mm);
      });
  return visibility;
}

}  // namespace rugae
