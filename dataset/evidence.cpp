#include "dataset/evidence.h"

#include <tbb/parallel_for.h>

#include <map>
#include <utility>

#include "core/check.h"

namespace rugae {

Rigid3 Evidence::motion(int from, int to, const Reading& reading) const {
  return reading.pose(sequence.world_from_camera[to]).inverse() *
         reading.pose(sequence.world_from_camera[from]);
}

cv::Mat Evidence::depth_of(int frame, const Reading& reading) {
  return has(frame + reading.depth_of) ? frames.depth_mm(frame + reading.depth_of) : cv::Mat();
}

Contest Evidence::depth_contest(const std::vector<FramePair>& pairs,
                                const std::vector<Reading>& readings) {
  std::vector<std::vector<double>> errors(readings.size());
  for (const FramePair& pair : pairs) {
    // of the frame itself, of the one before and of the next, as far as they are asked for
    std::map<int, std::pair<cv::Mat, cv::Mat>> depths;
    for (const Reading& reading : readings)
      if (const auto [at, fresh] = depths.try_emplace(reading.depth_of); fresh)
        at->second = {depth_of(pair.from, reading), depth_of(pair.to, reading)};
    tbb::parallel_for(std::size_t{0}, readings.size(), [&](std::size_t i) {
      const auto& [from, to] = depths.at(readings[i].depth_of);
      if (!from.empty() && !to.empty())
        append(errors[i], grid.depth_shares(from, to, motion(pair.from, pair.to, readings[i]),
                                            readings[i].kind));
    });
  }
  return Contest(errors);
}

std::string percent(double share) {
  return share <= 10.0 ? fmt::format("{:.2g} %", 100.0 * share) : "more than 1000 %";
}

std::string after(int gap) {
  return gap == 1 ? "the next frame" : fmt::format("the frame {} later", gap);
}

}  // namespace rugae
