#include "dataset/diagnose.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/units.h"
#include "dataset/contest.h"
#include "dataset/pose_mistakes.h"
#include "dataset/turn_search.h"
#include "dataset/warp_pairs.h"

namespace rugae {
namespace {

// Disagreements below these are those of sound files: of interpolated depth, of float flow.
constexpr double kSoundShare = 5e-4, kSoundFlow_px = 2e-3;
// What an explanation may leave: measured depth has a few per cent of noise.
constexpr double kExplainedShare = 0.03;

// A way to read the sequence: which depth, which pose, which flow stand for a frame.
struct Reading {
  std::string text;
  std::function<Rigid3(const Rigid3&)> pose = [](const Rigid3& p) { return p; };
  DepthKind kind = DepthKind::z;
};

std::vector<Reading> pose_readings() {
  std::vector<Reading> readings = {{"as given"}};
  for (const PoseMistake& mistake : pose_mistakes())
    readings.push_back({mistake.text, mistake.undo});
  readings.push_back({"range"});
  readings.back().kind = DepthKind::range;
  return readings;
}

class Diagnoser {
 public:
  Diagnoser(const WarpSequence& sequence, const WarpNames& names)
      : sequence_(sequence), names_(names), frames_(sequence), grid_(sequence.lens) {}

  Diagnosis all() {
    poses();
    if (sequence_.read_flow_px) flow();
    shifts();
    constexpr double kDisagree = 0.1;
    if (result_.problems.empty() && result_.depth_share > kDisagree)
      result_.problems.push_back(
          fmt::format("{}: disagrees with {}: depth led to the next frame is off by {} in the "
                      "median; no usual mistake explains it",
                      names_.depth, names_.poses, percent(result_.depth_share)));
    return std::move(result_);
  }
  Diagnosis colour() {
    colour_shift();
    return std::move(result_);
  }

 private:
  Rigid3 motion(int from, int to, const Reading& reading) const {
    return reading.pose(sequence_.world_from_camera[to]).inverse() *
           reading.pose(sequence_.world_from_camera[from]);
  }
  bool has(int frame) const { return frame >= 0 && frame < sequence_.size(); }

  template <typename Errors>
  static void append(std::vector<double>& to, const Errors& errors) {
    to.insert(to.end(), errors.begin(), errors.end());
  }

  static std::string percent(double share) {
    return share <= 10.0 ? fmt::format("{:.2g} %", 100.0 * share) : "more than 1000 %";
  }

  // Depth against poses: the depth of one frame led to another must be found there. Each gap
  // between the frames is a contest of its own, since slow and fast sequences tell at different
  // ones.
  void poses() {
    const std::vector<Reading> readings = pose_readings();
    std::size_t won = 0;
    double margin = 0.0;
    std::string evidence;
    for (const int gap : {1, 2, 4, 8, 16}) {
      const std::vector<FramePair> pairs = spread_pairs(sequence_.size(), gap);
      if (pairs.empty()) break;
      const Contest contest = depth_contest(pairs, readings);
      // frames too far apart to see the same wall tell nothing
      constexpr double kOverlap = 0.4;
      if (gap == 1 && static_cast<double>(contest.counts[0]) >=
                          std::max(Contest::kFewSamples,
                                   kOverlap * static_cast<double>(pairs.size() * grid_.patches())))
        result_.depth_share = contest.medians[0];
      const std::size_t winner = contest.winner(kSoundShare, kExplainedShare);
      if (winner == 0 || contest.margin(winner) <= margin) continue;
      won = winner;
      margin = contest.margin(winner);
      evidence = fmt::format("depth led to {} is off by {} as given, by {} otherwise", after(gap),
                             percent(contest.medians[0]), percent(contest.medians[winner]));
    }
    if (won == 0 && frozen_rotation()) return;
    if (won == 0) won = photometric_winner(readings, evidence);
    if (won == 0 && other_scale()) return;
    if (won == 0) return;
    reading_ = readings[won];
    if (reading_.kind == DepthKind::range)
      result_.problems.push_back(fmt::format(
          "{}: the depth is the distance along the ray, not along z: {}", names_.depth, evidence));
    else
      result_.problems.push_back(
          fmt::format("{}: the poses are wrong: {}: {}", names_.poses, reading_.text, evidence));
  }

  static std::string after(int gap) {
    return gap == 1 ? "the next frame" : fmt::format("the frame {} later", gap);
  }

  Contest depth_contest(const std::vector<FramePair>& pairs, const std::vector<Reading>& readings) {
    std::vector<std::vector<double>> errors(readings.size());
    for (const FramePair& pair : pairs) {
      const cv::Mat from = frames_.depth_mm(pair.from), to = frames_.depth_mm(pair.to);
      tbb::parallel_for(std::size_t{0}, readings.size(), [&](std::size_t i) {
        append(errors[i], grid_.depth_shares(from, to, motion(pair.from, pair.to, readings[i]),
                                             readings[i].kind));
      });
    }
    return Contest(errors);
  }

  // Where depth does not tell (a wall at the same distance everywhere), colour may.
  std::size_t photometric_winner(const std::vector<Reading>& readings, std::string& evidence) {
    for (const int gap : {4, 1}) {
      const std::vector<FramePair> pairs = spread_pairs(sequence_.size(), gap);
      if (pairs.empty()) continue;
      std::vector<std::vector<double>> errors(readings.size());
      for (const FramePair& pair : pairs) {
        const cv::Mat depth = frames_.depth_mm(pair.from);
        const cv::Mat from = frames_.image(pair.from), to = frames_.image(pair.to);
        tbb::parallel_for(std::size_t{0}, readings.size(), [&](std::size_t i) {
          append(errors[i],
                 grid_.colour_errors(from, depth, to, motion(pair.from, pair.to, readings[i]),
                                     readings[i].kind));
        });
      }
      const Contest contest(errors);
      constexpr double kSoundColour = 0.15, kExplainedColour = 0.2;
      const std::size_t winner = contest.winner(kSoundColour, kExplainedColour);
      if (winner == 0) continue;
      evidence = fmt::format("colour led to {} correlates to {:.2f} as given, to {:.2f} otherwise",
                             after(gap), 1.0 - contest.medians[0], 1.0 - contest.medians[winner]);
      return winner;
    }
    return 0;
  }

  // Rotations that are all the same though the pictures turn: for each pair the turn is sought that
  // makes depth agree. Where the camera really looked, the step between the two is seen from
  // another side too, so its direction is sought with it.
  bool frozen_rotation() {
    const auto& poses = sequence_.world_from_camera;
    constexpr double kSame_rad = 1e-6;
    frozen_ = std::ranges::all_of(poses, [&](const Rigid3& pose) {
      return angle_between_rad(pose.rotation, poses[0].rotation) <= kSame_rad;
    });
    if (!frozen_) return false;
    std::vector<FramePair> pairs = spread_pairs(sequence_.size(), 1);
    std::vector<std::vector<double>> given(pairs.size()), turned(pairs.size());
    std::vector<double> turns_deg(pairs.size());
    std::vector<std::pair<cv::Mat, cv::Mat>> depths;
    for (const FramePair& pair : pairs)
      depths.emplace_back(frames_.depth_mm(pair.from), frames_.depth_mm(pair.to));
    tbb::parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
      const Rigid3 moved = motion(pairs[i].from, pairs[i].to, {});
      const auto errors_of = [&](const Turns& turns) {
        return grid_.depth_shares(
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
    frozen_ = contest.winner(kSoundShare, kExplainedShare) != 0;
    if (frozen_)
      result_.problems.push_back(fmt::format(
          "{}: the rotation never changes, though the camera turns by {:.2g} degrees to the next "
          "frame: depth led there is off by {} as given, by {} turned",
          names_.poses, median_of(turns_deg), percent(contest.medians[0]),
          percent(contest.medians[1])));
    return frozen_;
  }

  // A unit nobody thought of: the factor of the poses' lengths for which depth agrees best.
  bool other_scale() {
    for (const int gap : {4, 1}) {
      const std::vector<FramePair> pairs = spread_pairs(sequence_.size(), gap);
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
        const Contest contest = depth_contest(pairs, readings);
        const auto best = std::min_element(contest.medians.begin() + 1, contest.medians.end());
        factor = factors[static_cast<std::size_t>(best - contest.medians.begin())];
        return std::pair(contest, static_cast<std::size_t>(best - contest.medians.begin()));
      };
      contest_around(1e4, 64);
      for (const double width : {1.15, 1.03, 1.004}) contest_around(width, 8);
      const auto [contest, best] = contest_around(1.0005, 4);
      if (contest.winner(kSoundShare, kExplainedShare) == 0) continue;
      result_.problems.push_back(
          fmt::format("{}: the poses are wrong: {}: depth led to {} is off by {} as given, by {} "
                      "otherwise",
                      names_.poses, scale_mistake(factor), after(gap), percent(contest.medians[0]),
                      percent(contest.medians[best])));
      reading_ = readings[best];
      return true;
    }
    return false;
  }

  // Flow against depth and poses (read rightly by now). Each alternative takes depth, poses or
  // flow of another frame, or the flow another way.
  void flow() {
    struct Alternative {
      std::string text;
      int depth, pose, flow;  // frames later
      std::function<cv::Mat(const cv::Mat&)> as = [](const cv::Mat& f) { return f; };
    };
    const std::vector<Alternative> alternatives = {
        {"", 0, 0, 0},
        {"the flow's sign is flipped", 0, 0, 0, [](const cv::Mat& f) { return cv::Mat(-f); }},
        {"the flow's x and y are swapped", 0, 0, 0,
         [](const cv::Mat& f) {
           cv::Mat swapped(f.size(), f.type());
           cv::mixChannels(f, swapped, {0, 1, 1, 0});
           return swapped;
         }},
        {"the flow leads to the frame before, not to the next: its sign and frame are off", 0, 0, 1,
         [](const cv::Mat& f) { return cv::Mat(-f); }},
        {"the flow is shifted by one frame: that of the frame before fits", 0, 0, -1},
        {"the flow is shifted by one frame: that of the next frame fits", 0, 0, 1},
        {"the depth is shifted by one frame: that of the frame before fits", -1, 0, 0},
        {"the depth is shifted by one frame: that of the next frame fits", 1, 0, 0},
        {"the poses are shifted by one frame: those of the frame before fit", 0, -1, 0},
        {"the poses are shifted by one frame: those of the next frame fit", 0, 1, 0}};
    std::vector<std::vector<double>> errors(alternatives.size());
    for (const FramePair& pair : spread_pairs(sequence_.size(), 1)) {
      const int t = pair.from;
      if (!has(t - 1) || !has(t + 2)) continue;
      for (std::size_t i = 0; i < alternatives.size(); ++i) {
        const Alternative& a = alternatives[i];
        const cv::Mat flow = frames_.flow_px(t + a.flow);
        if (flow.empty()) continue;
        append(errors[i],
               grid_.flow_errors_px(frames_.depth_mm(t + a.depth), a.as(flow),
                                    motion(t + a.pose, t + a.pose + 1, reading_), reading_.kind));
      }
    }
    const Contest contest(errors);
    if (contest.counts[0] < Contest::kFewSamples) return;
    result_.flow_px = contest.medians[0];
    if (frozen_) return;
    const std::size_t winner = contest.winner(kSoundFlow_px, 1.0);
    constexpr double kDisagree_px = 1.0;
    if (winner == 0 && !(contest.medians[0] > kDisagree_px)) return;
    const bool of_depth = winner == 6 || winner == 7, of_poses = winner == 8 || winner == 9;
    depth_and_poses_apart_ = of_depth || of_poses;
    result_.problems.push_back(
        winner == 0
            ? fmt::format("{}: disagrees with depth and poses by {:.3g} px in the median; no usual "
                          "mistake explains it",
                          names_.flow, contest.medians[0])
            : fmt::format("{}: {}: depth, poses and flow disagree by {:.3g} px as given, by {:.3g} "
                          "px otherwise",
                          of_depth   ? names_.depth
                          : of_poses ? names_.poses
                                     : names_.flow,
                          alternatives[winner].text, contest.medians[0], contest.medians[winner]));
  }

  // Depth against poses and colour, one frame off. Between neighbours of a steady path that is
  // hardly seen; pairs are taken whose motion differs most from that of the pair one frame later.
  void shifts() {
    if (frozen_ || depth_and_poses_apart_) return;
    const bool flow_holds = result_.flow_px >= 0.0 && result_.flow_px <= 0.05;
    if (flow_holds) return colour_shift();
    const std::vector<FramePair> pairs = telling();
    std::vector<std::vector<double>> errors(3);
    for (const FramePair& pair : pairs) {
      const Rigid3 moved = motion(pair.from, pair.to, reading_);
      for (const int shift : {0, -1, 1})
        append(errors[shift < 0   ? 1
                      : shift > 0 ? 2
                                  : 0],
               grid_.depth_shares(frames_.depth_mm(pair.from + shift),
                                  frames_.depth_mm(pair.to + shift), moved, reading_.kind));
    }
    const Contest contest(errors);
    const std::size_t winner = contest.winner(kSoundShare, kExplainedShare);
    if (winner == 0) return colour_shift();
    const int shift = winner == 1 ? -1 : 1;
    // Who is off: with colour as given, depth; with colour as the depth, the poses.
    std::vector<double> depth_off, poses_off;
    for (const FramePair& pair : pairs) {
      const Rigid3 moved = motion(pair.from, pair.to, reading_);
      const cv::Mat depth = frames_.depth_mm(pair.from + shift);
      append(depth_off, grid_.colour_errors(frames_.image(pair.from), depth, frames_.image(pair.to),
                                            moved, reading_.kind));
      append(poses_off, grid_.colour_errors(frames_.image(pair.from + shift), depth,
                                            frames_.image(pair.to + shift), moved, reading_.kind));
    }
    const double depth_error = median_of(depth_off), poses_error = median_of(poses_off);
    const char* frame = shift < 0 ? "the frame before" : "the next frame";
    const std::string evidence =
        fmt::format("depth led to other frames is off by {} as given, by {} otherwise",
                    percent(contest.medians[0]), percent(contest.medians[winner]));
    constexpr double kClearColour = 0.85;
    if (depth_error <= kClearColour * poses_error)
      result_.problems.push_back(fmt::format(
          "{}: the depth is shifted by one frame: that of {} fits the poses and the colour: {}",
          names_.depth, frame, evidence));
    else if (poses_error <= kClearColour * depth_error)
      result_.problems.push_back(
          fmt::format("{}: the poses are shifted by one frame: depth and colour of {} fit: {}",
                      names_.poses, frame, evidence));
    else
      result_.problems.push_back(
          fmt::format("{}: depth and poses are shifted by one frame against each other: the depth "
                      "of {} fits: {}",
                      names_.depth, frame, evidence));
  }

  std::vector<FramePair> telling() {
    return telling_pairs(sequence_, grid_, reading_.pose, frames_.middle_depth_mm());
  }

  void colour_shift() {
    const std::vector<FramePair> pairs = telling();
    if (pairs.size() < 3) return;
    struct Votes {
      double sum = 0.0;
      int better = 0, counted = 0;
    };
    std::map<int, Votes> votes;
    double given_sum = 0.0;
    for (const FramePair& pair : pairs) {
      const Rigid3 moved = motion(pair.from, pair.to, reading_);
      const cv::Mat depth = frames_.depth_mm(pair.from);
      std::map<int, double> error;
      for (const int shift : {-1, 0, 1}) {
        const std::vector<double> e =
            grid_.colour_errors(frames_.image(pair.from + shift), depth,
                                frames_.image(pair.to + shift), moved, reading_.kind);
        error[shift] = e.size() >= 20 ? median_of(e) : NAN;
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
      result_.problems.push_back(fmt::format(
          "{}: colour and depth are misaligned by one frame: the images of {} fit depth and poses: "
          "colour led to other frames correlates to {:.3f} as given, to {:.3f} otherwise",
          names_.images, shift < 0 ? "the frame before" : "the next frame",
          1.0 - given_sum / v.counted, 1.0 - v.sum / v.counted));
    }
  }

  const WarpSequence& sequence_;
  const WarpNames& names_;
  FrameCache frames_;
  WarpGrid grid_;
  Reading reading_;
  bool frozen_ = false, depth_and_poses_apart_ = false;
  Diagnosis result_;
};

}  // namespace

Diagnosis diagnose(const WarpSequence& sequence, const WarpNames& names) {
  return Diagnoser(sequence, names).all();
}

std::vector<std::string> diagnose_colour(const WarpSequence& sequence, const WarpNames& names) {
  return Diagnoser(sequence, names).colour().problems;
}

}  // namespace rugae
