#pragma once
// What the parts of a diagnosis share: the frames, how they are led to each other under a reading
// of the files, and how well that fits.

#include <string>
#include <vector>

#include "dataset/contest.h"
#include "dataset/diagnose.h"
#include "dataset/readings.h"
#include "dataset/warp_pairs.h"

namespace rugae {

// Disagreements below this are those of sound files: of interpolated depth.
inline constexpr double kSoundShare = 5e-4;
// What an explanation may leave: measured depth has a few per cent of noise.
inline constexpr double kExplainedShare = 0.03;

struct Evidence {
  const WarpSequence& sequence;
  const WarpNames& names;
  FrameCache frames;
  WarpGrid grid;

  Evidence(const WarpSequence& of_sequence, const WarpNames& of_names)
      : sequence(of_sequence), names(of_names), frames(of_sequence), grid(of_sequence.lens) {}

  bool has(int frame) const { return frame >= 0 && frame < sequence.size(); }
  /// to_from_from.
  Rigid3 motion(int from, int to, const Reading& reading) const;
  /// Empty outside the sequence.
  cv::Mat depth_of(int frame, const Reading& reading);
  /// The depth of one frame led to another against that found there, under each reading.
  Contest depth_contest(const std::vector<FramePair>& pairs, const std::vector<Reading>& readings);
};

inline void append(std::vector<double>& to, const std::vector<double>& errors) {
  to.insert(to.end(), errors.begin(), errors.end());
}
std::string percent(double share);
std::string after(int gap);  // "the next frame", "the frame 4 later"

}  // namespace rugae
