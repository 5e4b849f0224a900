#pragma once
// Gates: bounds on metrics, each with the reason for its number.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "studies/cell.h"
#include "studies/study_file.h"

namespace rugae {

struct GateOutcome {
  std::string cell;  // the cell's name
  std::string metric;
  std::string expected;  // "below 41.7"
  std::string found;     // the number, "not measured" or "no such metric; did you mean ..."
  std::string reason;
  bool passed = false;
  /// "misumi-v5506, trajectory 1, paper: trajectory.ate_sim3_rmse_mm is 52.1, expected below 41.7:
  /// <reason>".
  std::string line() const;
};

/// Holds every gate against every cell it names. A metric that is null, missing or not finite
/// fails; so does a gate that names no cell of the study.
std::vector<GateOutcome> hold_gates(const std::vector<Gate>& gates,
                                    const std::vector<CellResult>& cells);

/// The number at a path such as "depth.sim3.abs_rel"; null when there is none.
const nlohmann::json& metric_at(const nlohmann::json& metrics, const std::string& path);

}  // namespace rugae
