#pragma once
// Do the labels of a frame keep what its masks promise, and do depth, pose and flow agree?

#include <string>
#include <vector>

#include "dataset/flow_agreement.h"
#include "dataset/truth.h"

namespace rugae {

/// One problem of one frame. Problems of the same kind in several frames are told once.
struct LabelProblem {
  std::string kind;
  std::string text;  // names the file
};

struct LabelCheck {
  std::vector<LabelProblem> problems;
  FlowAgreement flow;
};

/// What the labels of frame `index` are to be compared with.
struct LabelSources {
  const DatasetLayout& layout;
  const Lens& lens;
  const PoseTrack& track;
  const Camera* camera = nullptr;      // with a rolling shutter: its
  const TriangleMesh* wall = nullptr;  // where it moves: at rest
  bool sharp = true;  // the colours are those of one ray a pixel, as the labels are
};

/// Reads the labels of the frame and compares them; a label that is missing or cannot be read is a
/// problem of kind "unreadable".
LabelCheck check_labels(const LabelSources& sources, int index);

}  // namespace rugae
