#pragma once
// The whole loop over a matrix of settings, from one YAML file: datasets, estimates, metrics,
// tables, one page.

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"

namespace rugae {

struct StudyResult {
  int cells = 0;
  std::vector<std::string> failed_gates;  // one line each, with the gate's reason
  std::filesystem::path report;
};

/// STUDY.yaml: scene, resolution, frames, seed or seeds: [...], cameras: [...], trajectories:
/// [...], methods: [...], render: {settings}, recon: {options}, axes: {recon.preprocess.undistort:
/// [true, false], ...}, gates: [{metric: trajectory.ate_sim3_rmse_mm, below: 40, reason: ...,
/// where: {recon.preprocess.undistort: true}}]. Every combination of all lists is a cell; cells
/// share what is the same, and finished parts of an earlier run are kept.
///
/// Writes results.json, table.csv, times.json, repeats.csv (of several seeds), junit.xml (the gates
/// as test cases) and report.html.
StudyResult run_study(const std::filesystem::path& study, const std::filesystem::path& out,
                      Progress& progress);

}  // namespace rugae
