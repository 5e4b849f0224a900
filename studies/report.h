#pragma once
// The page of a study: one file that needs nothing else.

#include <string>
#include <vector>

#include "studies/cell.h"
#include "studies/gates.h"
#include "studies/study_file.h"

namespace rugae {

struct ReportInput {
  const StudyOptions& study;
  const std::string& study_text;
  const std::vector<CellResult>& cells;
  const std::vector<GateOutcome>& gates;
};

/// The template viewer/report.html (under preset_root()) with the study's pictures, plots and
/// tables filled in. Reads the datasets and estimates of the cells.
std::string report_html(const ReportInput& input);

}  // namespace rugae
