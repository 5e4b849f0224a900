#pragma once
// All metrics of an estimate against the truth, and their JSON.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/progress.h"
#include "dataset/estimate.h"
#include "dataset/truth.h"

namespace rugae {

/// Reads both folders and returns every metric of design section 9, by name with its unit:
/// {"trajectory": {"ate_sim3_rmse_mm": ...}, "depth": {...}, "surface": {...}, "tracking": {...},
/// "time": {...}}.
nlohmann::json evaluate(const std::filesystem::path& dataset, const std::filesystem::path& estimate,
                        Progress& progress);

}  // namespace rugae
