#pragma once
// A part of a study with all that came of it; a study without parts is one.

#include <vector>

#include "studies/cell.h"
#include "studies/gates.h"
#include "studies/study_file.h"
#include "studies/summary.h"

namespace rugae {

struct StudyPart {
  const StudyOptions& options;
  std::vector<CellResult> cells;
  std::vector<GateOutcome> gates;
  Summary summary;

  bool has_seeds() const { return options.seeds.size() > 1; }
};

std::vector<GateOutcome> all_gates(const std::vector<StudyPart>& parts);
std::vector<CellResult> all_cells(const std::vector<StudyPart>& parts);

}  // namespace rugae
