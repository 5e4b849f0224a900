#include "dataset/pose_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/units.h"
#include "dataset/pose_mistakes.h"
#include "dataset/turn_search.h"

namespace rugae {

// Rotations that are all the same though the pictures turn: for each pair the turn is sought that
// makes depth agree. Where the camera really looked, the step between the two is seen from
// another side too, so its direction is sought with it.
std::optional<std::string> frozen_rotation(Evidence& e) {
  const auto& poses = e.sequence.world_from_camera;
  constexpr double kSame_rad = 1e-6;
  const bool same = std::ranges::all_of(poses, [&](const Rigid3& pose) {
    return angle_between_rad(pose.rotation, poses[0].rotation) <= kSame_rad;
  });
  if (!same) return std::nullopt;
  std::vector<FramePair> pairs = spread_pairs(e.sequence.size(), 1);
  std::vector<std::vector<double>> given(pairs.size()), turned(pairs.size());
  std::vector<double> turns_deg(pairs.size());
  std::vector<std::pair<cv::Mat, cv::Mat>> depths;
  for (const FramePair& pair : pairs)
    depths.emplace_back(e.frames.depth_mm(pair.from), e.frames.depth_mm(pair.to));
  tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
    const Rigid3 moved = e.motion(pairs[i].from, pairs[i].to, {});
    const auto errors_of = [&](const Turns& turns) {
      return e.grid.depth_shares(
          depths[i].first, depths[i].second,
          Rigid3(rotation_of(turns.head<3>()), rotation_of(turns.tail<3>()) * moved.translation));
    };
    const Turns best = best_turns(errors_of);
    given[i] = errors_of(Turns::Zero());
    turned[i] = errors_of(best);
    turns_deg[i] = deg_from_rad(best.head<3>().norm());
  });
  std::vector<double> all_given, all_turned;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    append(all_given, given[i]);
    append(all_turned, turned[i]);
  }
  const Contest contest({all_given, all_turned});
  if (contest.winner(kSoundShare, kExplainedShare) == 0) return std::nullopt;
  return fmt::format(
      "{}: the rotation never changes, though the camera turns by {:.2g} degrees to the next "
      "frame: depth led there is off by {} as given, by {} turned",
      e.names.poses, median_of(turns_deg), percent(contest.medians[0]),
      percent(contest.medians[1]));
}

// A unit nobody thought of: the factor of the poses' lengths for which depth agrees best.
std::optional<FoundScale> other_scale(Evidence& e) {
  for (const int gap : {4, 1}) {
    const std::vector<FramePair> pairs = spread_pairs(e.sequence.size(), gap);
    if (pairs.empty()) continue;
    double factor = 1.0;
    std::vector<Reading> readings;
    std::vector<double> factors;
    const auto contest_around = [&](double width, int steps) {
      readings = {{"as given"}};
      factors = {1.0};
      for (int k = -steps; k <= steps; ++k) {
        factors.push_back(factor * std::pow(width, double(k) / steps));
        readings.push_back({"", [f = factors.back()](const Rigid3& p) {
                              return Rigid3(p.rotation, f * p.translation);
                            }});
      }
      const Contest contest = e.depth_contest(pairs, readings);
      const auto best = std::min_element(contest.medians.begin() + 1, contest.medians.end());
      factor = factors[static_cast<std::size_t>(best - contest.medians.begin())];
      return std::pair(contest, static_cast<std::size_t>(best - contest.medians.begin()));
    };
    contest_around(1e4, 64);
    for (const double width : {1.15, 1.03, 1.004}) contest_around(width, 8);
    const auto [contest, best] = contest_around(1.0005, 4);
    if (contest.winner(kSoundShare, kExplainedShare) == 0) {
      // frames near each other fit nearly as well when the poses hardly move at all
      if (static_cast<double>(contest.counts[best]) >= Contest::kFewSamples &&
          contest.medians[best] > kExplainedShare)
        return std::nullopt;
      continue;
    }
    return FoundScale{
        readings[best],
        fmt::format("{}: the poses are wrong: {}: depth led to {} is off by {} as given, by {} "
                    "otherwise",
                    e.names.poses, scale_mistake(factor), after(gap), percent(contest.medians[0]),
                    percent(contest.medians[best])),
        contest.medians[best]};
  }
  return std::nullopt;
}

}  // namespace rugae
