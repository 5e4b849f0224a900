#pragma once
// What may be wrong with the depth, poses and flow of a dataset that do not agree: the usual
// mistakes, one or two at once, each with the ways to read the files that undo it.

#include <functional>
#include <string>
#include <vector>

#include "core/rigid3.h"
#include "dataset/warp.h"

namespace rugae {

/// A way to read the files: which depth, poses and flow stand for the frame.
struct FilesReading {
  int depth_of = 0, poses_of = 0, flow_of = 0, wall_of = 0;  // frames later
  int flow_to = 1;                                           // the frame the flow leads to
  DepthKind kind = DepthKind::z;
  double depth_factor = 1.0;
  double flow_sign = 1.0;
  bool flow_swapped = false;
  std::function<Rigid3(const Rigid3&)> pose;  // empty: as it is
};

struct FlowExplanation {
  std::string text;
  std::vector<FilesReading> readings;  // of which one may do where another finds no files
  bool two_at_once = false;
};

/// Single mistakes first, then two at once: of two parts, or both of the poses, in either order.
/// Two shifts of the poses may undo each other, and then everything is that of another frame.
const std::vector<FlowExplanation>& flow_explanations();

}  // namespace rugae
