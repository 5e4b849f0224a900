#include "studies/time_left.h"

#include <filesystem>
#include <limits>
#include <set>

#include "cameras/camera.h"

namespace rugae {
namespace {

/// Parts of a cell's time, as 720 frames of 640 x 480 have them with `paper`: of 285 s of one core
/// 95 are rendering, 100 the motion, 90 map and measures. A single stage takes some 15.
constexpr double kRendering = 0.33, kMotion = 0.35, kMap = 0.32, kStage = 0.05;
constexpr double kOfAFrame = 1e5;  // what a frame costs beside its pixels, in pixels

double pixels_of(const CellJob& job) {
  const Camera camera = load_camera(job.cell.camera);
  return frames_of(job) * (static_cast<double>(camera.lens.width) * camera.lens.height + kOfAFrame);
}

}  // namespace

TimeLeft::TimeLeft(const std::vector<CellJob>& jobs) {
  std::set<std::filesystem::path> counted;
  for (const CellJob& job : jobs) {
    double share = 0.0;
    for (const auto& dataset : {job.files.dataset, job.files.frames})
      if (!dataset_finished(dataset) && counted.insert(dataset).second) share += kRendering;
    if (job.study->measure != Measure::loop) {
      share += kStage;
    } else {
      share += kMap;
      const auto& motion = job.files.motion;
      const bool shared = !motion.empty() && (exists(motion) || !counted.insert(motion).second);
      if (!shared) share += kMotion;
    }
    left_ += weights_[job.index] = share * pixels_of(job);
  }
}

void TimeLeft::made(const CellJob& job) {
  skipped(job);
  made_ += weights_.at(job.index);
}

void TimeLeft::skipped(const CellJob& job) { left_ -= weights_.at(job.index); }

double TimeLeft::seconds_left(double elapsed_s) const {
  return made_ > 0.0 ? elapsed_s / made_ * left_ : std::numeric_limits<double>::infinity();
}

}  // namespace rugae
