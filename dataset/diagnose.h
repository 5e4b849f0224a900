#pragma once
// What is wrong with a sequence whose files are each sound: depth, poses, flow and colour are led
// to each other, and where they disagree the usual mistakes are undone in turn. The one that makes
// them agree by a clear margin is named.

#include <string>
#include <vector>

#include "dataset/warp.h"

namespace rugae {

/// The files as they are called in messages.
struct WarpNames {
  std::string images, depth, poses, flow;
};

struct Diagnosis {
  std::vector<std::string> problems;  // one line each
  std::vector<std::string> notes;     // what could not be looked at
  bool compared = false;              // whether anything could be led to another frame
  double depth_share = -1.0;          // how far depth led to the next frame is off; -1: not known
  double flow_px = -1.0;              // how far the flow is off where depth and poses lead
};

/// Poses (transposed, inverted, flipped axes, another unit, rotations that never change), depth
/// (distance along the ray, one frame off), flow (flipped sign, swapped channels, one frame off),
/// colour one frame off; two mistakes at once of poses and depth, or of flow and one of these. A
/// disagreement that none of them explains is a problem too; frames that hardly show the same wall
/// are a note. A sample of at most some hundred pairs of frames is read.
Diagnosis diagnose(const WarpSequence& sequence, const WarpNames& names);

/// Only whether colour is one frame off the depth and the poses, which agree: a line, or nothing.
std::vector<std::string> diagnose_colour(const WarpSequence& sequence, const WarpNames& names);

}  // namespace rugae
