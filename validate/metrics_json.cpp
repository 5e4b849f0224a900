#include "validate/metrics_json.h"

#include <nlohmann/json.hpp>

#include "core/check.h"

namespace rugae {
namespace {

using nlohmann::json;

// "<name>_rmse_<unit>" and so on; null where there were no errors to sum.
void add_stats(json& out, const std::string& name, const std::string& unit,
               const ErrorStats& stats) {
  const auto value = [&](double v) { return stats.count > 0 ? json(v) : json(); };
  out[name + "_rmse_" + unit] = value(stats.rmse);
  out[name + "_mean_" + unit] = value(stats.mean);
  out[name + "_median_" + unit] = value(stats.median);
  out[name + "_max_" + unit] = value(stats.max);
}

void add_absolute(json& out, const std::string& name, const std::optional<AbsoluteError>& error) {
  add_stats(out, "ate_" + name, "mm", error ? error->position_mm : ErrorStats{});
  add_stats(out, "rotation_" + name, "rad", error ? error->rotation_rad : ErrorStats{});
}

void add_relative(json& out, const std::string& name, const RelativeError& error) {
  add_stats(out, "rpe_" + name + "_translation", "mm", error.translation_mm);
  add_stats(out, "rpe_" + name + "_rotation", "rad", error.rotation_rad);
  out["rpe_" + name + "_steps"] = error.translation_mm.count;
  out["rpe_" + name + "_steps_possible"] = error.possible;
}

}  // namespace

json trajectory_json(const PoseErrors& errors) {
  json out;
  add_absolute(out, "sim3", errors.sim3);
  add_absolute(out, "se3", errors.se3);
  add_relative(out, "frame", errors.per_frame);
  add_relative(out, "1s", errors.per_second);
  add_relative(out, "10mm", errors.per_10mm);
  out["scale_mm_per_unit"] = errors.sim3 ? json(errors.sim3->truth_from_estimate.scale) : json();
  // Of an estimate that claims millimetres: its lengths over the true ones, less 1.
  out["scale_error"] =
      errors.sim3 ? json(1.0 / errors.sim3->truth_from_estimate.scale - 1.0) : json();
  out["path_length_mm"] = errors.length_mm;
  out["note"] = errors.note;
  return out;
}

json depth_json(const std::optional<DepthError>& error) {
  if (!error) return json();
  return {{"abs_rel", error->abs_rel},
          {"sq_rel_mm", error->sq_rel_mm},
          {"rmse_mm", error->rmse_mm},
          {"rmse_log", error->rmse_log},
          {"delta_125", error->delta_125},
          {"valid_share", error->valid_share},
          {"frames", static_cast<int>(error->frames)}};
}

json surface_json(const std::optional<SurfaceError>& error) {
  if (!error) return json();
  json out;
  add_stats(out, "accuracy", "mm", error->estimate_to_truth_mm);
  add_stats(out, "completeness", "mm", error->truth_to_estimate_mm);
  out["chamfer_mean_mm"] = error->chamfer_mean_mm;
  out["chamfer_median_mm"] = error->chamfer_median_mm;
  for (const Thresholded& at : error->at) {
    const std::string place = fmt::format("at_{:g}mm", at.threshold_mm);
    out["precision_" + place] = at.precision;
    out["recall_" + place] = at.recall;
    out["f_" + place] = at.f;
  }
  if (error->sigma)
    out["sigma"] = {{"within_1", error->sigma->within_1},
                    {"within_2", error->sigma->within_2},
                    {"median_error_over_sigma", error->sigma->median_ratio},
                    {"median_mm", error->sigma->median_sigma_mm}};
  return out;
}

json transform_json(const std::optional<Sim3>& transform) {
  if (!transform) return json();
  const Quat& q = transform->rotation;
  const Vec3& t = transform->translation;
  return {{"scale", transform->scale},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"translation_mm", {t.x(), t.y(), t.z()}}};
}

std::optional<Sim3> transform_from_json(const json& in) {
  if (in.is_null()) return std::nullopt;
  const auto q = in.at("rotation_xyzw").get<std::vector<double>>();
  const auto t = in.at("translation_mm").get<std::vector<double>>();
  check(q.size() == 4 && t.size() == 3, "transform: {} and {} values, expected 4 and 3", q.size(),
        t.size());
  return Sim3{in.at("scale").get<double>(), Quat(q[3], q[0], q[1], q[2]), Vec3(t[0], t[1], t[2])};
}

}  // namespace rugae
