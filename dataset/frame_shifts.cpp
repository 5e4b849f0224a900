#include "dataset/frame_shifts.h"

#include <cmath>
#include <map>

#include "core/check.h"

namespace rugae {
namespace {

std::vector<FramePair> telling(Evidence& e, const Reading& reading) {
  return telling_pairs(e.sequence, e.grid, reading.pose, e.frames.middle_depth_mm());
}

}  // namespace

// Depth against poses and colour, one frame off. Between neighbours of a steady path that is
// hardly seen; pairs are taken whose motion differs most from that of the pair one frame later.
std::vector<std::string> frame_shifts(Evidence& e, const Reading& reading) {
  const std::vector<FramePair> pairs = telling(e, reading);
  std::vector<std::vector<double>> errors(3);
  for (const FramePair& pair : pairs) {
    const Rigid3 moved = e.motion(pair.from, pair.to, reading);
    for (const int shift : {0, -1, 1})
      append(errors[shift < 0   ? 1
                    : shift > 0 ? 2
                                : 0],
             e.grid.depth_shares(e.frames.depth_mm(pair.from + shift),
                                 e.frames.depth_mm(pair.to + shift), moved, reading.kind));
  }
  const Contest contest(errors);
  const std::size_t winner = contest.winner(kSoundShare, kExplainedShare);
  if (winner == 0) return colour_shift(e, reading);
  const int shift = winner == 1 ? -1 : 1;
  // Who is off: with colour as given, depth; with colour as the depth, the poses.
  std::vector<double> depth_off, poses_off;
  for (const FramePair& pair : pairs) {
    const Rigid3 moved = e.motion(pair.from, pair.to, reading);
    const cv::Mat depth = e.frames.depth_mm(pair.from + shift);
    append(depth_off, e.grid.colour_errors(e.frames.image(pair.from), depth,
                                           e.frames.image(pair.to), moved, reading.kind));
    append(poses_off, e.grid.colour_errors(e.frames.image(pair.from + shift), depth,
                                           e.frames.image(pair.to + shift), moved, reading.kind));
  }
  const double depth_error = median_of(depth_off), poses_error = median_of(poses_off);
  const char* frame = shift < 0 ? "the frame before" : "the next frame";
  const std::string evidence =
      fmt::format("depth led to other frames is off by {} as given, by {} otherwise",
                  percent(contest.medians[0]), percent(contest.medians[winner]));
  constexpr double kClearColour = 0.85;
  if (depth_error <= kClearColour * poses_error)
    return {fmt::format(
        "{}: the depth is shifted by one frame: that of {} fits the poses and the colour: {}",
        e.names.depth, frame, evidence)};
  if (poses_error <= kClearColour * depth_error)
    return {fmt::format("{}: the poses are shifted by one frame: depth and colour of {} fit: {}",
                        e.names.poses, frame, evidence)};
  return {
      fmt::format("{}: depth and poses are shifted by one frame against each other: the depth "
                  "of {} fits: {}",
                  e.names.depth, frame, evidence)};
}

std::vector<std::string> colour_shift(Evidence& e, const Reading& reading) {
  std::vector<std::string> problems;
  const std::vector<FramePair> pairs = telling(e, reading);
  if (pairs.size() < 3) return problems;
  struct Votes {
    double sum = 0.0;
    int better = 0, counted = 0;
  };
  std::map<int, Votes> votes;
  double given_sum = 0.0;
  for (const FramePair& pair : pairs) {
    const Rigid3 moved = e.motion(pair.from, pair.to, reading);
    const cv::Mat depth = e.frames.depth_mm(pair.from);
    std::map<int, double> error;
    for (const int shift : {-1, 0, 1}) {
      const std::vector<double> errors =
          e.grid.colour_errors(e.frames.image(pair.from + shift), depth,
                               e.frames.image(pair.to + shift), moved, reading.kind);
      error[shift] = errors.size() >= 20 ? median_of(errors) : NAN;
    }
    if (std::isnan(error[0]) || std::isnan(error[-1]) || std::isnan(error[1])) continue;
    given_sum += error[0];
    for (const int shift : {-1, 1}) {
      votes[shift].sum += error[shift];
      votes[shift].better += error[shift] < error[0] ? 1 : 0;
      ++votes[shift].counted;
    }
  }
  for (const int shift : {-1, 1}) {
    const Votes& v = votes[shift];
    constexpr double kClearColour = 0.75, kMostPairs = 0.7;
    if (v.counted < 3 || !(v.better >= kMostPairs * v.counted) ||
        !(v.sum <= kClearColour * given_sum))
      continue;
    problems.push_back(fmt::format(
        "{}: colour and depth are misaligned by one frame: the images of {} fit depth and poses: "
        "colour led to other frames correlates to {:.3f} as given, to {:.3f} otherwise",
        e.names.images, shift < 0 ? "the frame before" : "the next frame",
        1.0 - given_sum / v.counted, 1.0 - v.sum / v.counted));
  }
  return problems;
}

}  // namespace rugae
