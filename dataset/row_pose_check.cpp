#include "dataset/row_pose_check.h"

#include <algorithm>
#include <functional>

#include "core/check.h"
#include "core/units.h"
#include "dataset/pose_mistakes.h"
#include "dataset/truth.h"

namespace rugae {
namespace fs = std::filesystem;
namespace {

// The pose of the middle row, and how far the rows beside it are from it: where the camera starts
// or stops in the middle of a frame, the pose lies between theirs.
struct Middle {
  Rigid3 pose;
  double step_mm = 0.0, step_rad = 0.0;

  explicit Middle(const RowPoses& rows) {
    const int height = static_cast<int>(rows.poses().size()) - 2, row = height / 2;
    pose = rows.at(0.5 * height);
    const Rigid3 &above = rows.of_row(row - 1), &below = rows.of_row(row);
    step_mm = (above.translation - below.translation).norm();
    step_rad = angle_between_rad(above.rotation, below.rotation);
  }
  double off_mm(const Rigid3& p) const { return (p.translation - pose.translation).norm(); }
  double off_rad(const Rigid3& p) const { return angle_between_rad(p.rotation, pose.rotation); }
  bool is(const Rigid3& p) const {
    constexpr double kSame_mm = 1e-6, kSame_rad = 1e-6;
    return off_mm(p) <= step_mm + kSame_mm && off_rad(p) <= step_rad + kSame_rad;
  }
};

std::string explanation(const PoseTrack& track, const std::vector<Middle>& middles) {
  const int frames = static_cast<int>(middles.size());
  const auto all = [&](const std::function<bool(int)>& holds) {
    int held = 0;
    for (int i = 0; i < frames; ++i) held += holds(i) ? 1 : 0;
    return held + 1 >= frames;  // the last or the first of a shifted sequence may be anything
  };
  const auto pose = [&](int i) -> const Rigid3& {
    return track[static_cast<std::size_t>(i)].world_from_camera;
  };
  const auto middle = [&](int i) -> const Middle& { return middles[static_cast<std::size_t>(i)]; };
  for (const PoseMistake& mistake : pose_mistakes())
    if (all([&](int i) { return middle(i).is(mistake.undo(pose(i))); }))
      return "; the poses are wrong: " + mistake.text;
  for (const int by : {-1, 1})
    if (all([&](int i) { return i + by >= 0 && i + by < frames && middle(i).is(pose(i + by)); }))
      return fmt::format("; the poses are shifted by one frame: those of the {} fit",
                         by < 0 ? "frame before" : "next frame");
  if (all([&](int i) { return angle_between_rad(pose(i).rotation, pose(0).rotation) <= 1e-6; }))
    return "; the rotation never changes";
  return {};
}

}  // namespace

void check_row_poses(const DatasetLayout& layout, const Camera& camera, const PoseTrack& track,
                     ProblemList& problems) {
  std::vector<Middle> middles;
  for (int i = 0; i < static_cast<int>(track.size()); ++i) {
    if (!fs::exists(layout.row_poses(i))) return;  // none at all, or told by the list of files
    try {
      middles.emplace_back(read_row_poses(layout.row_poses(i), camera));
    } catch (const Error&) {  // told with the labels of its frame
      return;
    }
  }
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const Rigid3& pose = track[i].world_from_camera;
    if (middles[i].is(pose)) continue;
    problems.note(fmt::format(
        "{}: the pose of frame {} is {:.3g} mm and {:.3g} degrees off that of the middle row in "
        "{}{}",
        layout.trajectory().string(), i, middles[i].off_mm(pose),
        deg_from_rad(middles[i].off_rad(pose)), layout.row_poses(static_cast<int>(i)).string(),
        explanation(track, middles)));
    return;
  }
}

}  // namespace rugae
