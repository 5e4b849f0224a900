#include "dataset/diagnose.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/units.h"
#include "dataset/contest.h"
#include "dataset/image_overlap.h"
#include "dataset/pose_mistakes.h"
#include "dataset/readings.h"
#include "dataset/turn_search.h"
#include "dataset/warp_pairs.h"

namespace rugae {
namespace {

// Disagreements below these are those of sound files: of interpolated depth, of float flow.
constexpr double kSoundShare = 5e-4, kSoundFlow_px = 2e-3;
// What an explanation may leave: measured depth has a few per cent of noise.
constexpr double kExplainedShare = 0.03;

class Diagnoser {
 public:
  Diagnoser(const WarpSequence& sequence, const WarpNames& names)
      : sequence_(sequence), names_(names), frames_(sequence), grid_(sequence.lens) {}

  Diagnosis all() {
    poses();
    if (sequence_.read_flow_px) flow();
    shifts();
    if (result_.problems.empty()) unexplained();
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
    const std::vector<Reading> readings = single_readings();
    Won won;
    std::size_t winner_of_all = 0;
    std::vector<Contest> contests;
    for (const int gap : {1, 2, 4, 8, 16}) {
      const std::vector<FramePair> pairs = spread_pairs(sequence_.size(), gap);
      if (pairs.empty()) break;
      const Contest& contest = contests.emplace_back(depth_contest(pairs, readings));
      keep_as_given(gap, contest, static_cast<double>(pairs.size() * grid_.patches()));
      const std::size_t winner = contest.winner(kSoundShare, kExplainedShare);
      if (winner == 0 || contest.margin(winner) <= won.margin) continue;
      winner_of_all = winner;
      won = {readings[winner], contest.margin(winner), contest.medians[winner],
             depth_evidence(gap, contest, winner)};
    }
    // between neighbours of a slow path poses that hardly move at all fit as well
    constexpr double kElsewhere = 0.1;
    if (!fits_all(contests, winner_of_all, kElsewhere)) won = {};
    if (won.margin == 0.0 && frozen_rotation()) return;
    // what a single mistake leaves over may be another one
    constexpr double kLeftOver = 2e-3;
    if (won.margin == 0.0 ? !result_.compared || worst_share_ > kExplainedShare
                          : won.left > kLeftOver)
      if (two_mistakes(won.reading)) return;
    if (won.margin == 0.0 && result_.compared) won = photometric_winner(readings);
    if (won.margin == 0.0) {
      other_scale();
      return;
    }
    reading_ = won.reading;
    result_.problems.push_back(
        fmt::format("{}: {}: {}", reading_.kind == DepthKind::range ? names_.depth : names_.poses,
                    reading_.text, won.evidence));
  }

  // The reading that fits best so far; margin 0: none.
  struct Won {
    Reading reading = {"as given"};
    double margin = 0.0, left = 0.0;
    std::string evidence;
  };

  // Wherever enough of it was compared.
  static bool fits_all(const std::vector<Contest>& contests, std::size_t reading, double most) {
    return std::ranges::all_of(contests, [&](const Contest& contest) {
      return static_cast<double>(contest.counts[reading]) < Contest::kFewSamples ||
             contest.medians[reading] <= most;
    });
  }

  static std::string depth_evidence(int gap, const Contest& contest, std::size_t winner) {
    return fmt::format("depth led to {} is off by {} as given, by {} otherwise", after(gap),
                       percent(contest.medians[0]), percent(contest.medians[winner]));
  }

  // How far the files as they are were compared, and how far they disagree at most.
  void keep_as_given(int gap, const Contest& contest, double patches) {
    const double landed = static_cast<double>(contest.counts[0]);
    overlap_ = std::max(overlap_, landed / patches);
    // frames too far apart to see the same wall tell nothing
    constexpr double kOverlap = 0.4;
    const bool tells = landed >= std::max(Contest::kFewSamples, kOverlap * patches);
    if (gap == 1 && tells) result_.depth_share = contest.medians[0];
    if (tells && !(contest.medians[0] <= worst_share_)) {
      worst_share_ = contest.medians[0];
      worst_gap_ = gap;
    }
    const bool agrees = landed >= Contest::kFewSamples && contest.medians[0] <= kExplainedShare;
    result_.compared = result_.compared || tells || agrees;
  }

  // Two mistakes at once hide each other. There are so many pairs of them that the one which fits
  // must fit well between frames near each other and far apart, and colour must not speak against
  // it.
  bool two_mistakes(const Reading& single) {
    std::vector<Reading> readings = paired_readings();
    const Reading given = readings[0];
    readings[0] = single;  // better than that
    Won won;
    std::size_t winner_of_all = 0;
    std::vector<Contest> contests;
    for (const int gap : {1, 4, 16}) {
      const std::vector<FramePair> pairs = spread_pairs(sequence_.size(), gap);
      if (pairs.empty()) break;
      const Contest& contest = contests.emplace_back(depth_contest(pairs, readings));
      const std::size_t winner = contest.winner(kSoundShare, kExplainedShare);
      constexpr double kLeast = 6.0;
      if (winner == 0 || contest.margin(winner) <= std::max(kLeast, won.margin)) continue;
      if (winner >= kFirstPair && !colour_allows(pairs, readings[winner])) continue;
      winner_of_all = winner;
      won = {readings[winner], contest.margin(winner), contest.medians[winner],
             depth_evidence(gap, depth_contest(pairs, {given, readings[winner]}), 1)};
    }
    // a shift alone is told by shifts()
    if (winner_of_all < kFirstPair || !fits_all(contests, winner_of_all, kExplainedShare))
      return false;
    reading_ = won.reading;
    depth_and_poses_apart_ = reading_.depth_of != 0;
    result_.problems.push_back(
        fmt::format("{}: {}: {}", names_.poses, reading_.text, won.evidence));
    return true;
  }

  bool colour_allows(const std::vector<FramePair>& pairs, const Reading& reading) {
    std::vector<double> errors;
    for (const FramePair& pair : pairs)
      if (const cv::Mat depth = depth_of(pair.from, reading); !depth.empty())
        append(errors, grid_.colour_errors(frames_.image(pair.from), depth, frames_.image(pair.to),
                                           motion(pair.from, pair.to, reading), reading.kind));
    constexpr double kUnlike = 0.7;  // unrelated patches: about 1
    return static_cast<double>(errors.size()) < Contest::kFewSamples ||
           median_of(std::move(errors)) <= kUnlike;
  }

  // Empty outside the sequence.
  cv::Mat depth_of(int frame, const Reading& reading) {
    return has(frame + reading.depth_of) ? frames_.depth_mm(frame + reading.depth_of) : cv::Mat();
  }

  // No mistake was found: was there anything to find one by?
  void unexplained() {
    constexpr double kDisagree = 0.1;
    if (worst_share_ > kDisagree) {
      result_.problems.push_back(fmt::format(
          "{}: disagrees with {}: depth led to {} is off by {} in the median; no usual mistake "
          "explains it, nor two at once",
          names_.depth, names_.poses, after(worst_gap_), percent(worst_share_)));
    } else if (!result_.compared) {
      const std::string little = fmt::format(
          "as depth and poses have it, {} of a frame lies in another one", percent(overlap_));
      if (neighbours_look_alike())
        result_.problems.push_back(fmt::format(
            "{}: disagrees with {}: {}, but images show the same wall as the next; no usual "
            "mistake explains it, nor two at once",
            names_.depth, names_.poses, little));
      else
        result_.notes.push_back(
            fmt::format("{}, {}, {}: nothing could be compared: frames hardly show the same wall: "
                        "{}",
                        names_.depth, names_.poses, names_.images, little));
    }
  }

  bool neighbours_look_alike() {
    std::vector<double> shares;
    for (const FramePair& pair : spread_pairs(sequence_.size(), 1))
      shares.push_back(found_again(sequence_.read_gray(pair.from), sequence_.read_gray(pair.to)));
    constexpr double kAlike = 0.5;
    return !shares.empty() && median_of(std::move(shares)) >= kAlike;
  }

  static std::string after(int gap) {
    return gap == 1 ? "the next frame" : fmt::format("the frame {} later", gap);
  }

  Contest depth_contest(const std::vector<FramePair>& pairs, const std::vector<Reading>& readings) {
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
          append(errors[i], grid_.depth_shares(from, to, motion(pair.from, pair.to, readings[i]),
                                               readings[i].kind));
      });
    }
    return Contest(errors);
  }

  // Where depth does not tell (a wall at the same distance everywhere), colour may.
  Won photometric_winner(const std::vector<Reading>& readings) {
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
      return {readings[winner], contest.margin(winner), 0.0,
              fmt::format("colour led to {} correlates to {:.2f} as given, to {:.2f} otherwise",
                          after(gap), 1.0 - contest.medians[0], 1.0 - contest.medians[winner])};
    }
    return {};
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
  void other_scale() {
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
      if (contest.winner(kSoundShare, kExplainedShare) == 0) {
        // frames near each other fit nearly as well when the poses hardly move at all
        if (static_cast<double>(contest.counts[best]) >= Contest::kFewSamples &&
            contest.medians[best] > kExplainedShare)
          return;
        continue;
      }
      result_.problems.push_back(
          fmt::format("{}: the poses are wrong: {}: depth led to {} is off by {} as given, by {} "
                      "otherwise",
                      names_.poses, scale_mistake(factor), after(gap), percent(contest.medians[0]),
                      percent(contest.medians[best])));
      reading_ = readings[best];
      return;
    }
  }

  // Flow against depth and poses (read rightly by now). Each alternative takes depth, poses or
  // flow of another frame, or the flow another way.
  void flow() {
    const std::vector<FlowReading> readings = flow_readings();
    std::vector<std::vector<double>> errors(readings.size());
    for (const FramePair& pair : spread_pairs(sequence_.size(), 1)) {
      const int t = pair.from;
      if (!has(t - 1) || !has(t + 2)) continue;
      for (std::size_t i = 0; i < readings.size(); ++i) {
        const FlowReading& r = readings[i];
        const cv::Mat flow = frames_.flow_px(t + r.flow_of),
                      depth = depth_of(t + r.depth_of, reading_);
        if (flow.empty() || depth.empty()) continue;
        append(errors[i], grid_.flow_errors_px(depth, r.flow(flow),
                                               motion(t + r.poses_of, t + r.poses_of + 1, reading_),
                                               reading_.kind));
      }
    }
    const Contest contest(errors);
    if (contest.counts[0] < Contest::kFewSamples) return;
    result_.flow_px = contest.medians[0];
    result_.compared = true;
    if (frozen_) return;
    const std::size_t winner = contest.winner(kSoundFlow_px, 1.0);
    constexpr double kDisagree_px = 1.0;
    if (winner == 0 && !(contest.medians[0] > kDisagree_px)) return;
    const FlowReading& r = readings[winner];
    depth_and_poses_apart_ |= r.depth_of != 0 || r.poses_of != 0;
    const bool of_flow = winner == 0 || (r.depth_of == 0 && r.poses_of == 0) || r.pair;
    result_.problems.push_back(
        winner == 0
            ? fmt::format("{}: disagrees with depth and poses by {:.3g} px in the median; no usual "
                          "mistake explains it, nor two at once",
                          names_.flow, contest.medians[0])
            : fmt::format("{}: {}: depth, poses and flow disagree by {:.3g} px as given, by {:.3g} "
                          "px otherwise",
                          of_flow           ? names_.flow
                          : r.depth_of != 0 ? names_.depth
                                            : names_.poses,
                          r.text, contest.medians[0], contest.medians[winner]));
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
  double overlap_ = 0.0;       // the largest share of a frame that lies in another, as given
  double worst_share_ = -1.0;  // how far depth is off as given, where enough of it lies there
  int worst_gap_ = 1;
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
