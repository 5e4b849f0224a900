#pragma once
// Metrics as JSON: every name says its unit; what could not be measured is null.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "validate/depth_error.h"
#include "validate/pose_error.h"
#include "validate/surface_error.h"

namespace rugae {

/// {"ate_sim3_rmse_mm", ..., "ate_se3_rmse_mm", ..., "rpe_frame_translation_rmse_mm", ...,
/// "rotation_mean_rad", "scale_mm_per_unit", "path_length_mm", "note"}.
nlohmann::json trajectory_json(const PoseErrors& errors);
nlohmann::json depth_json(const std::optional<DepthError>& error);
/// {"accuracy_mean_mm", "completeness_mean_mm", "chamfer_mean_mm", "f_at_1mm", ...}.
nlohmann::json surface_json(const std::optional<SurfaceError>& error);
/// {"scale", "rotation_xyzw", "translation_mm"}, target_from_source; null when empty.
nlohmann::json transform_json(const std::optional<Sim3>& transform);
/// The inverse of transform_json; empty for null.
std::optional<Sim3> transform_from_json(const nlohmann::json& json);

}  // namespace rugae
