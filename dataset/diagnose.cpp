#include "dataset/diagnose.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "dataset/evidence.h"
#include "dataset/frame_shifts.h"
#include "dataset/image_overlap.h"
#include "dataset/pose_search.h"
#include "dataset/readings.h"

namespace rugae {
namespace {

constexpr double kSoundFlow_px = 2e-3;  // disagreements below this are those of float flow

class Diagnoser {
 public:
  Diagnoser(const WarpSequence& sequence, const WarpNames& names) : evidence_(sequence, names) {}

  Diagnosis all() {
    poses();
    if (evidence_.sequence.read_flow_px) flow();
    const bool flow_holds = result_.flow_px >= 0.0 && result_.flow_px <= 0.05;
    if (!frozen_ && !depth_and_poses_apart_)
      note(flow_holds ? colour_shift(evidence_, reading_) : frame_shifts(evidence_, reading_));
    if (result_.problems.empty()) unexplained();
    return std::move(result_);
  }
  Diagnosis colour() {
    note(colour_shift(evidence_, reading_));
    return std::move(result_);
  }

 private:
  void note(const std::vector<std::string>& problems) {
    result_.problems.insert(result_.problems.end(), problems.begin(), problems.end());
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
      const std::vector<FramePair> pairs = spread_pairs(evidence_.sequence.size(), gap);
      if (pairs.empty()) break;
      const Contest& contest = contests.emplace_back(evidence_.depth_contest(pairs, readings));
      keep_as_given(gap, contest, static_cast<double>(pairs.size() * evidence_.grid.patches()));
      const std::size_t winner = contest.winner(kSoundShare, kExplainedShare);
      if (winner == 0 || contest.margin(winner) <= won.margin) continue;
      winner_of_all = winner;
      won = {readings[winner], contest.margin(winner), contest.medians[winner],
             depth_evidence(gap, contest, winner)};
    }
    // between neighbours of a slow path poses that hardly move at all fit as well
    constexpr double kElsewhere = 0.1;
    if (!fits_all(contests, winner_of_all, kElsewhere)) won = {};
    if (won.margin == 0.0)
      if (const auto problem = frozen_rotation(evidence_)) {
        frozen_ = true;
        return note({*problem});
      }
    // what a single mistake leaves over may be another one
    constexpr double kLeftOver = 2e-3;
    if (won.margin == 0.0 ? !result_.compared || worst_share_ > kExplainedShare
                          : won.left > kLeftOver)
      if (two_mistakes(won.reading)) return;
    // a mistake that is none of the usual ones may look like one of them, but not as well
    constexpr double kMuchBetter = 0.5;
    if (won.margin > 0.0 && won.left > kLeftOver)
      if (const auto found = other_scale(evidence_);
          found && found->left < kMuchBetter * won.left) {
        reading_ = found->reading;
        return note({found->problem});
      }
    if (won.margin == 0.0 && result_.compared) won = photometric_winner(readings);
    if (won.margin == 0.0) {
      if (const auto found = other_scale(evidence_)) {
        reading_ = found->reading;
        note({found->problem});
      }
      return;
    }
    reading_ = won.reading;
    result_.problems.push_back(fmt::format(
        "{}: {}: {}",
        reading_.kind == DepthKind::range ? evidence_.names.depth : evidence_.names.poses,
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
      const std::vector<FramePair> pairs = spread_pairs(evidence_.sequence.size(), gap);
      if (pairs.empty()) break;
      const Contest& contest = contests.emplace_back(evidence_.depth_contest(pairs, readings));
      const std::size_t winner = contest.winner(kSoundShare, kExplainedShare);
      constexpr double kLeast = 6.0;
      if (winner == 0 || contest.margin(winner) <= std::max(kLeast, won.margin)) continue;
      if (winner >= kFirstPair && !colour_allows(pairs, readings[winner])) continue;
      winner_of_all = winner;
      won = {readings[winner], contest.margin(winner), contest.medians[winner],
             depth_evidence(gap, evidence_.depth_contest(pairs, {given, readings[winner]}), 1)};
    }
    // a shift alone is told by shifts()
    if (winner_of_all < kFirstPair || !fits_all(contests, winner_of_all, kExplainedShare))
      return false;
    reading_ = won.reading;
    depth_and_poses_apart_ = reading_.depth_of != 0;
    result_.problems.push_back(
        fmt::format("{}: {}: {}", evidence_.names.poses, reading_.text, won.evidence));
    return true;
  }

  bool colour_allows(const std::vector<FramePair>& pairs, const Reading& reading) {
    std::vector<double> errors;
    for (const FramePair& pair : pairs)
      if (const cv::Mat depth = evidence_.depth_of(pair.from, reading); !depth.empty())
        append(errors, evidence_.grid.colour_errors(evidence_.frames.image(pair.from), depth,
                                                    evidence_.frames.image(pair.to),
                                                    evidence_.motion(pair.from, pair.to, reading),
                                                    reading.kind));
    constexpr double kUnlike = 0.7;  // unrelated patches: about 1
    return static_cast<double>(errors.size()) < Contest::kFewSamples ||
           median_of(std::move(errors)) <= kUnlike;
  }

  // No mistake was found: was there anything to find one by?
  void unexplained() {
    constexpr double kDisagree = 0.1;
    if (worst_share_ > kDisagree) {
      result_.problems.push_back(fmt::format(
          "{}: disagrees with {}: depth led to {} is off by {} in the median; no usual mistake "
          "explains it, nor two at once",
          evidence_.names.depth, evidence_.names.poses, after(worst_gap_), percent(worst_share_)));
    } else if (!result_.compared) {
      const std::string little = fmt::format(
          "as depth and poses have it, {} of a frame lies in another one", percent(overlap_));
      if (neighbours_look_alike())
        result_.problems.push_back(fmt::format(
            "{}: disagrees with {}: {}, but images show the same wall as the next; no usual "
            "mistake explains it, nor two at once",
            evidence_.names.depth, evidence_.names.poses, little));
      else
        result_.notes.push_back(fmt::format(
            "{}, {}, {}: nothing could be compared: frames hardly show the same wall: "
            "{}",
            evidence_.names.depth, evidence_.names.poses, evidence_.names.images, little));
    }
  }

  bool neighbours_look_alike() {
    std::vector<double> shares;
    for (const FramePair& pair : spread_pairs(evidence_.sequence.size(), 1))
      shares.push_back(found_again(evidence_.sequence.read_gray(pair.from),
                                   evidence_.sequence.read_gray(pair.to)));
    constexpr double kAlike = 0.5;
    return !shares.empty() && median_of(std::move(shares)) >= kAlike;
  }

  // Where depth does not tell (a wall at the same distance everywhere), colour may.
  Won photometric_winner(const std::vector<Reading>& readings) {
    for (const int gap : {4, 1}) {
      const std::vector<FramePair> pairs = spread_pairs(evidence_.sequence.size(), gap);
      if (pairs.empty()) continue;
      std::vector<std::vector<double>> errors(readings.size());
      for (const FramePair& pair : pairs) {
        const cv::Mat depth = evidence_.frames.depth_mm(pair.from);
        const cv::Mat from = evidence_.frames.image(pair.from),
                      to = evidence_.frames.image(pair.to);
        tbb::parallel_for(std::size_t{0}, readings.size(), [&](std::size_t i) {
          append(errors[i], evidence_.grid.colour_errors(
                                from, depth, to, evidence_.motion(pair.from, pair.to, readings[i]),
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

  // Flow against depth and poses (read rightly by now). Each alternative takes depth, poses or
  // flow of another frame, or the flow another way.
  void flow() {
    const std::vector<FlowReading> readings = flow_readings();
    std::vector<std::vector<double>> errors(readings.size());
    for (const FramePair& pair : spread_pairs(evidence_.sequence.size(), 1)) {
      const int t = pair.from;
      if (!evidence_.has(t - 1) || !evidence_.has(t + 2)) continue;
      for (std::size_t i = 0; i < readings.size(); ++i) {
        const FlowReading& r = readings[i];
        const cv::Mat flow = evidence_.frames.flow_px(t + r.flow_of),
                      depth = evidence_.depth_of(t + r.depth_of, reading_);
        if (flow.empty() || depth.empty()) continue;
        append(errors[i],
               evidence_.grid.flow_errors_px(
                   depth, r.flow(flow),
                   evidence_.motion(t + r.poses_of, t + r.poses_of + 1, reading_), reading_.kind));
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
                          evidence_.names.flow, contest.medians[0])
            : fmt::format("{}: {}: depth, poses and flow disagree by {:.3g} px as given, by {:.3g} "
                          "px otherwise",
                          of_flow           ? evidence_.names.flow
                          : r.depth_of != 0 ? evidence_.names.depth
                                            : evidence_.names.poses,
                          r.text, contest.medians[0], contest.medians[winner]));
  }

  Evidence evidence_;
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
