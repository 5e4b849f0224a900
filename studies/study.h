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

/// STUDY.yaml: scene, resolution, seed, frames, cameras: [...], trajectories: [...], methods:
/// [...], recon: {options}, gates: [{metric: trajectory.ate_sim3_rmse_mm, below: 40, reason: ...}].
/// Finished cells of an earlier run are kept.
StudyResult run_study(const std::filesystem::path& study, const std::filesystem::path& out,
                      Progress& progress);

}  // namespace rugae
