#include "studies/study_part.h"

namespace rugae {

std::vector<GateOutcome> all_gates(const std::vector<StudyPart>& parts) {
  std::vector<GateOutcome> all;
  for (const StudyPart& part : parts) all.insert(all.end(), part.gates.begin(), part.gates.end());
  return all;
}

std::vector<CellResult> all_cells(const std::vector<StudyPart>& parts) {
  std::vector<CellResult> all;
  for (const StudyPart& part : parts) all.insert(all.end(), part.cells.begin(), part.cells.end());
  return all;
}

}  // namespace rugae
