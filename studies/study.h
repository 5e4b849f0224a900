#pragma once
// The whole loop over a matrix of settings, from one YAML file: datasets, estimates, metrics,
// tables, one page.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "studies/run_cells.h"

namespace rugae {

struct StudyResult {
  int cells = 0;
  std::vector<std::string> failed_cells;  // one line each, with the reason
  std::vector<std::string> failed_gates;  // one line each, with the gate's reason
  std::filesystem::path report;
};

/// STUDY.yaml as docs/studies.md has it: lists of cameras, trajectories, methods and seeds, axes,
/// gates, tables, or parts that are studies of their own. Every combination of all lists is a cell;
/// cells share what is the same, and finished parts of an earlier run are kept.
///
/// Writes results.json, table.csv, times.json, repeats.csv (of several seeds), tables/ (what the
/// study asks for), junit.xml (the gates as test cases) and report.html.
StudyResult run_study(const std::filesystem::path& study, const std::filesystem::path& out,
                      const RunOptions& options, Progress& progress);

/// Makes one cell alone, by its place among all cells of the study: what run_study() has its
/// processes do.
void run_one_cell(const std::filesystem::path& study, const std::filesystem::path& out, int index,
                  Progress& progress);

}  // namespace rugae
