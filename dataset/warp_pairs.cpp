#include "dataset/warp_pairs.h"

#include <algorithm>
#include <cmath>

namespace rugae {
namespace {

constexpr int kSpread = 12, kTelling = 24;
constexpr std::size_t kKept = 40;  // frames in memory
constexpr int kStarts = 60, kSteps = 200;
// A pair sees enough of the same wall if so many patches land, and moved no more than so far.
constexpr double kLanding = 0.6, kFarthestShare = 0.25;

}  // namespace

std::vector<FramePair> spread_pairs(int frames, int gap) {
  std::vector<FramePair> pairs;
  const int last = frames - 1 - gap;
  if (last < 0) return pairs;
  const int count = std::min(kSpread, last + 1);
  for (int i = 0; i < count; ++i) {
    const int from = count == 1 ? 0 : static_cast<int>(std::lround(double(last) * i / (count - 1)));
    pairs.push_back({from, from + gap});
  }
  return pairs;
}

std::vector<FramePair> telling_pairs(const WarpSequence& sequence, const WarpGrid& grid,
                                     const std::function<Rigid3(const Rigid3&)>& pose,
                                     double depth_mm) {
  struct Candidate {
    FramePair pair;
    double differs_px;
  };
  const int frames = sequence.size();
  const auto& poses = sequence.world_from_camera;
  const auto motion = [&](int from, int to) {
    return pose(poses[to]).inverse() * pose(poses[from]);
  };
  const cv::Mat depth(sequence.lens.height, sequence.lens.width, CV_32F, cv::Scalar(depth_mm));
  std::vector<Candidate> candidates;
  const int from_step = std::max(1, frames / kStarts), to_step = std::max(1, frames / kSteps);
  for (int from = 1; from + 2 < frames; from += from_step) {
    std::vector<int> others;
    for (int gap = 1; gap <= 8; ++gap) others.push_back(from + gap);
    for (int to = from + 8 + to_step; to < frames; to += to_step) others.push_back(to);
    Candidate best{{}, 0.0};
    for (const int to : others) {
      if (to + 1 >= frames) break;
      const Rigid3 moved = motion(from, to);
      // the whole grid only for those that may do: the axis is led first
      const Vec3 ahead = moved * Vec3(0, 0, depth_mm);
      const auto place = sequence.lens.project(ahead);
      if (!place || !sequence.lens.contains(*place)) continue;
      const Vec3 later = motion(from + 1, to + 1) * Vec3(0, 0, depth_mm),
                 before = motion(from - 1, to - 1) * Vec3(0, 0, depth_mm);
      const double differs_px =
          sequence.lens.fx / depth_mm * std::min((later - ahead).norm(), (before - ahead).norm());
      if (!(differs_px > best.differs_px)) continue;
      const WarpGrid::Landing landing = grid.landing(depth, moved);
      if (landing.share < kLanding || landing.median_px > kFarthestShare * sequence.lens.width)
        continue;
      best = {{from, to}, differs_px};
    }
    if (best.differs_px > 0.0) candidates.push_back(best);
  }
  std::ranges::stable_sort(candidates, std::greater<>(), &Candidate::differs_px);
  if (candidates.size() > kTelling) candidates.resize(kTelling);
  std::vector<FramePair> pairs;
  for (const Candidate& c : candidates) pairs.push_back(c.pair);
  return pairs;
}

template <typename Read>
cv::Mat FrameCache::find(Kept& kept, int frame, Read&& read) {
  for (auto it = kept.begin(); it != kept.end(); ++it)
    if (it->first == frame) {
      kept.splice(kept.begin(), kept, it);
      return kept.front().second;
    }
  kept.emplace_front(frame, read(frame));
  if (kept.size() > kKept) kept.pop_back();
  return kept.front().second;
}

cv::Mat FrameCache::image(int frame) {
  return find(images_, frame, [&](int i) { return WarpGrid::smoothed(sequence_.read_gray(i)); });
}
cv::Mat FrameCache::depth_mm(int frame) { return find(depths_, frame, sequence_.read_depth_mm); }
cv::Mat FrameCache::flow_px(int frame) { return find(flows_, frame, sequence_.read_flow_px); }

double FrameCache::middle_depth_mm() {
  std::vector<double> middles;
  for (const FramePair& pair : spread_pairs(sequence_.size(), 1)) {
    std::vector<double> depths;
    const cv::Mat depth = depth_mm(pair.from);
    for (int y = 0; y < depth.rows; y += 8)
      for (int x = 0; x < depth.cols; x += 8)
        if (const float z = depth.at<float>(y, x); std::isfinite(z) && z > 0.0f)
          depths.push_back(z);
    if (!depths.empty()) middles.push_back(median_of(std::move(depths)));
  }
  return median_of(std::move(middles));
}

}  // namespace rugae
