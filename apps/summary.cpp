// The lines people read of the metrics; everything is in the JSON.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/commands.h"

namespace rugae {
namespace {

using nlohmann::json;

std::string number(const json& parent, const char* key, const char* unit, double factor = 1.0) {
  const json value = parent.is_object() ? parent.value(key, json()) : json();
  if (!value.is_number()) return "not measured";
  return fmt::format("{:.3g}{}", factor * value.get<double>(), unit);
}

}  // namespace

std::string summary_text(const json& metrics) {
  const json& path = metrics.at("trajectory");
  const json& tracking = metrics.at("tracking");
  const json& surface = metrics.at("surface");
  std::string text =
      fmt::format("tracked            {} of {} frames\n", tracking.at("tracked").get<int>(),
                  tracking.at("frames").get<int>());
  text += fmt::format(
      "path, Sim(3)       ATE {}, mean {}, median {}\n", number(path, "ate_sim3_rmse_mm", " mm"),
      number(path, "ate_sim3_mean_mm", " mm"), number(path, "ate_sim3_median_mm", " mm"));
  text +=
      fmt::format("path, SE(3)        ATE {}, {} mm a map unit\n",
                  number(path, "ate_se3_rmse_mm", " mm"), number(path, "scale_mm_per_unit", ""));
  const json& depth = metrics.at("depth");
  const auto abs_rel = [&](const char* which) {
    return number(depth.value(which, json()), "abs_rel", "");
  };
  text += fmt::format("depth              AbsRel {} (median scaled {})\n", abs_rel("sim3"),
                      abs_rel("median_scaled"));
  if (depth.contains("as_given"))
    text += fmt::format("depth, in mm       AbsRel {}, RMSE {}\n", abs_rel("as_given"),
                        number(depth.at("as_given"), "rmse_mm", " mm"));
  for (const auto& [key, name] : {std::pair{"trajectory_aligned", "map, by the path "},
                                  {"icp_aligned", "map, by ICP      "}}) {
    const json& aligned = surface.at(key);
    text += fmt::format("{}  accuracy mean {}, completeness mean {}, Chamfer {}\n", name,
                        number(aligned, "accuracy_mean_mm", " mm"),
                        number(aligned, "completeness_mean_mm", " mm"),
                        number(aligned, "chamfer_mean_mm", " mm"));
  }
  if (const auto note = surface.value("note", ""); !note.empty())
    text += fmt::format("map, not measured  {}\n", note);
  const json& time = metrics.at("time");
  return text + fmt::format("time               {}, {} frames a second, {} peak",
                            number(time, "reconstruct_s", " s"), number(time, "frames_per_s", ""),
                            number(time, "peak_rss_mb", " MB"));
}

}  // namespace rugae
