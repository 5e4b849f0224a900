#pragma once
// All metrics of an estimate against the truth, and their JSON.

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
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

/// What is measured: what another program left, or an estimate of ours; what is empty is not.
struct EstimateFiles {
  std::filesystem::path trajectory = {};  // TUM, world_from_camera, at the frames' times; or the
                                          // folder of an estimate of ours, which needs no more
  std::filesystem::path map = {};         // any mesh file, in the trajectory's world
  std::filesystem::path depth = {};  // folder: EXR or 16-bit PNG named by their frames, along z
  double mm_per_unit = 1.0;          // of all three
  double depth_scale = 1.0;          // units of the trajectory a step of the depth files
  bool is_ours() const { return std::filesystem::is_directory(trajectory); }
  /// Throws Error naming what is missing or too much, or the field and its value.
  void check() const;
};

/// The same metrics of these. Depth has `as_given` beside them: in mm, not scaled.
nlohmann::json evaluate(const std::filesystem::path& dataset, const EstimateFiles& files,
                        Progress& progress);

}  // namespace rugae
