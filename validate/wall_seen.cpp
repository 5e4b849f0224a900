#include "validate/wall_seen.h"

#include "core/in_lots.h"

namespace rugae {
namespace {

constexpr std::size_t kFramesAtOnce = 16;  // whose depth is held

}  // namespace

Visibility wall_seen(const Truth& truth, const std::vector<int>& frames, Progress& progress) {
  Visibility visibility(truth.wall(), {});
  struct OfFrame {
    cv::Mat depth_mm;
    RowPoses camera;
    TriangleMesh moved;  // empty where the wall keeps still
  };
  const bool moves = truth.wall_moves();
  make_in_lots(
      frames.size(), kFramesAtOnce, progress,
      [&](std::size_t i) {
        const int frame = frames[i];
        return OfFrame{truth.depth_mm(frame), truth.row_poses(frame),
                       moves ? truth.wall(frame) : TriangleMesh()};
      },
      [&](std::size_t, const OfFrame& f) {
        const Lens& lens = truth.camera().lens;
        if (moves)
          visibility.add(lens, f.camera, f.depth_mm, f.moved);
        else
          visibility.add(lens, f.camera, f.depth_mm);
      });
  return visibility;
}

}  // namespace rugae
