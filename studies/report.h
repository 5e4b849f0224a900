#pragma once
// The page of a study: one file that needs nothing else.

#include <string>
#include <vector>

#include "core/progress.h"
#include "studies/study_part.h"

namespace rugae {

/// The template viewer/report.html (under preset_root()) with the study's pictures, plots and
/// tables filled in. Reads the datasets and estimates of the cells, some cells at a time.
std::string report_html(const Study& study, const std::vector<StudyPart>& parts,
                        Progress& progress);

}  // namespace rugae
