// Numbers: the few that matter first, and all of them.

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/units.h"
#include "studies/gates.h"
#include "studies/html.h"
#include "studies/published.h"
#include "studies/report_parts.h"

namespace rugae {
namespace {

using nlohmann::json;

double value_at(const json& metrics, const std::string& path) {
  const json& value = metric_at(metrics, path);
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::string card(const std::string& name, const std::string& value, const std::string& unit,
                 const std::string& beside) {
  return fmt::format(
      "<div class=\"card\"><div class=\"name\">{}</div><div class=\"value\">{}<small> {}</small>"
      "</div><div class=\"beside\">{}</div></div>\n",
      name, value, unit, beside);
}

// Two bars to one scale, ours and the paper's.
std::string against_paper(double ours, std::optional<double> paper, const std::string& unit,
                          bool more_is_better = false) {
  if (!paper) return "not in the paper";
  std::string text = fmt::format("the paper: {} {}", html::number(*paper), unit);
  if (!std::isfinite(ours)) return text;
  const double longest = std::max(ours, *paper);
  const bool better = more_is_better ? ours >= *paper : ours <= *paper;
  return text + fmt::format(
                    "<div class=\"two\"><i class=\"{}\" style=\"width:{:.1f}%\"></i>"
                    "<i style=\"width:{:.1f}%\"></i></div>",
                    better ? "better" : "worse", 100 * ours / longest, 100 * *paper / longest);
}

// Rows "what | value unit" from paths; a metric that was not measured shows a dash.
struct Line {
  const char* name;
  const char* path;
  const char* unit;
  double factor = 1.0;
};

template <std::size_t N>
std::string list(const json& metrics, const Line (&lines)[N]) {
  html::Table table;
  table.head = {"", "", ""};
  for (const Line& line : lines)
    table.rows.push_back(
        {line.name, html::number(line.factor * value_at(metrics, line.path), 4), line.unit});
  return table.str();
}

constexpr double kPercent = 100.0;

std::string trajectory_table(const json& metrics) {
  html::Table table;
  table.head = {"", "RMSE", "mean", "median", "largest", "unit"};
  const auto add = [&](const std::string& name, const std::string& path, const std::string& unit,
                       const std::string& shown_unit, double factor) {
    std::vector<std::string> row{name};
    for (const char* what : {"rmse", "mean", "median", "max"})
      row.push_back(html::number(
          factor * value_at(metrics, fmt::format("trajectory.{}_{}_{}", path, what, unit)), 4));
    row.push_back(shown_unit);
    table.rows.push_back(row);
  };
  add("Position, Sim(3)", "ate_sim3", "mm", "mm", 1);
  add("Position, SE(3)", "ate_se3", "mm", "mm", 1);
  add("Rotation, Sim(3)", "rotation_sim3", "rad", "deg", deg_from_rad(1));
  for (const auto& [key, name] :
       {std::pair{"frame", "1 frame"}, {"1s", "1 s"}, {"10mm", "10 mm"}}) {
    add(fmt::format("Step of {}, position", name), fmt::format("rpe_{}_translation", key), "mm",
        "mm", 1);
    add(fmt::format("Step of {}, rotation", name), fmt::format("rpe_{}_rotation", key), "rad",
        "deg", deg_from_rad(1));
  }
  return table.str();
}

std::string surface_table(const json& metrics) {
  const std::pair<const char*, const char*> columns[] = {
      {"placed by the path", "trajectory_aligned"},
      {"placed by ICP", "icp_aligned"},
      {"by ICP with scale", "icp_scaled"}};
  const Line lines[] = {{"Accuracy, mean", "accuracy_mean_mm", "mm"},
                        {"Accuracy, median", "accuracy_median_mm", "mm"},
                        {"Completeness, mean", "completeness_mean_mm", "mm"},
                        {"Completeness, median", "completeness_median_mm", "mm"},
                        {"Chamfer, mean", "chamfer_mean_mm", "mm"},
                        {"Chamfer, median", "chamfer_median_mm", "mm"},
                        {"F at 0.25 mm", "f_at_0.25mm", "%", kPercent},
                        {"F at 0.5 mm", "f_at_0.5mm", "%", kPercent},
                        {"F at 1 mm", "f_at_1mm", "%", kPercent},
                        {"F at 2 mm", "f_at_2mm", "%", kPercent},
                        {"F at 5 mm", "f_at_5mm", "%", kPercent},
                        {"F at 10 mm", "f_at_10mm", "%", kPercent}};
  html::Table table;
  table.head = {""};
  for (const auto& [name, key] : columns) table.head.push_back(name);
  table.head.push_back("unit");
  for (const Line& line : lines) {
    std::vector<std::string> row{line.name};
    for (const auto& [name, key] : columns) {
      // The names of thresholds hold dots: not a path for metric_at.
      const json& group = metric_at(metrics, fmt::format("surface.{}", key));
      const bool known =
          group.is_object() && group.contains(line.path) && group.at(line.path).is_number();
      row.push_back(known ? html::number(line.factor * group.at(line.path).get<double>(), 3)
                          : "&ndash;");
    }
    row.push_back(line.unit);
    table.rows.push_back(row);
  }
  return table.str();
}

std::string stage_table(const json& metrics) {
  html::Table table;
  table.head = {"Stage", "time (s)", "", "peak memory (MB)"};
  double longest = 0.0;
  const json& stages = metrics.at("time").at("stages");
  for (const json& stage : stages) longest = std::max(longest, stage.at("seconds").get<double>());
  for (const json& stage : stages) {
    const double seconds = stage.at("seconds");
    table.rows.push_back({html::escape(stage.at("name")), html::number(seconds),
                          fmt::format("<i class=\"meter\" style=\"width:{:.1f}%\"></i>",
                                      longest > 0.0 ? 100.0 * seconds / longest : 0.0),
                          fmt::format("{:.0f}", stage.at("peak_rss_mb").get<double>())});
  }
  return table.str();
}

std::string counts_table(const json& metrics) {
  html::Table table;
  table.head = {"", ""};
  for (const auto& [name, value] : metrics.at("reconstruction").items())
    if (value.is_number()) {
      const double number = value;
      const bool whole = number == std::floor(number);
      table.rows.push_back(
          {html::escape(name), whole ? fmt::format("{:.0f}", number) : html::number(number, 4)});
    }
  return table.str();
}

}  // namespace

std::string headline_cards(const CellView& view) {
  const json& metrics = view.cell.metrics;
  const Cell& cell = view.cell.cell;
  const auto paper = [&](const std::string& table) {
    return published(table, cell.trajectory, cell.camera);
  };
  const double ate = value_at(metrics, "trajectory.ate_sim3_rmse_mm");
  const double map = value_at(metrics, "surface.icp_aligned.accuracy_mean_mm");
  const double speed = value_at(metrics, "time.frames_per_s");
  const double seen = value_at(metrics, "coverage.seen_share");
  const int tracked = metrics.at("tracking").at("tracked");
  const int frames = metrics.at("tracking").at("frames");
  std::string out = "<div class=\"cards\">\n";
  // An error over a part of the path or wall is not one over the whole: say which.
  const std::string where =
      tracked < frames ? fmt::format("over {} of {} frames<br>", tracked, frames) : std::string();
  out += card("Path error, RMSE", html::number(ate), "mm",
              where + against_paper(ate, paper("ate"), "mm"));
  const json& surface = metric_at(metrics, "surface.icp_aligned");
  const double covered = surface.is_object() ? surface.value("recall_at_5mm", 0.0) : std::nan("");
  out += card("Map error, mean", html::number(map), "mm",
              fmt::format("covers {} % of the seen wall within 5 mm<br>",
                          html::number(kPercent * covered)) +
                  against_paper(map, paper("map"), "mm"));
  out += card("Frames tracked", fmt::format("{}", tracked), fmt::format("of {}", frames),
              html::number(value_at(metrics, "tracking.keyframes"), 1) + " key frames");
  out += card("Reconstructed", html::number(speed, 2), "frames/s",
              against_paper(speed, 1.0 / *published("time_of_pair", "300", "misumi-v5506"),
                            "pairs/s", true));
  out += card("Simulated", html::number(value_at(metrics, "simulation.frames_per_s"), 2),
              "frames/s", "with its labels");
  out += card("Wall seen", html::number(kPercent * seen), "%",
              fmt::format("{} of {} cm&sup2;",
                          html::number(value_at(metrics, "coverage.seen_area_mm2") / 100.0),
                          html::number(value_at(metrics, "coverage.wall_area_mm2") / 100.0)));
  out += "</div>\n";
  if (2 * tracked < frames)
    out += fmt::format(
        "<p class=\"note\">Only {} of {} frames could be placed. Errors below are over those "
        "alone, "
        "and say nothing about the rest of the path.</p>\n",
        tracked, frames);
  return out;
}

std::string tables_part(const CellView& view) {
  const json& m = view.cell.metrics;
  static constexpr Line kPath[] = {
      {"Length of the true path", "trajectory.path_length_mm", "mm"},
      {"Scale of the estimate", "trajectory.scale_mm_per_unit", "mm a map unit"},
      {"Frames tracked", "tracking.tracked_share", "%", kPercent}};
  static constexpr Line kCoverage[] = {
      {"Wall", "coverage.wall_area_mm2", "cm&sup2;", 0.01},
      {"Seen at all", "coverage.seen_share", "%", kPercent},
      {"Seen below 70&deg;, once or more", "coverage.covered_1_times_share", "%", kPercent},
      {"3 times or more", "coverage.covered_3_times_share", "%", kPercent},
      {"10 times or more", "coverage.covered_10_times_share", "%", kPercent}};
  html::Table depth;
  depth.head = {"Depth of key frames", "AbsRel",      "SqRel (mm)", "RMSE (mm)", "RMSE log",
                "&delta; &lt; 1.25",   "pixels known"};
  for (const auto& [name, key] :
       {std::pair{"scaled by the path", "sim3"}, {"scaled by the median", "median_scaled"}}) {
    std::vector<std::string> row{name};
    for (const char* what : {"abs_rel", "sq_rel_mm", "rmse_mm", "rmse_log"})
      row.push_back(html::number(value_at(m, fmt::format("depth.{}.{}", key, what))));
    for (const char* what : {"delta_125", "valid_share"})
      row.push_back(html::number(kPercent * value_at(m, fmt::format("depth.{}.{}", key, what))) +
                    " %");
    depth.rows.push_back(row);
  }
  return "<div class=\"tables\"><section><h4>Path</h4>" + trajectory_table(m) + list(m, kPath) +
         "</section><section><h4>Surface</h4>" + surface_table(m) +
         "</section><section><h4>Depth</h4>" + depth.str() +
         "</section><section><h4>Coverage</h4>" + list(m, kCoverage) +
         "</section><section><h4>Time and memory</h4>" + stage_table(m) +
         "</section><section><h4>Reconstruction</h4>" + counts_table(m) + "</section></div>\n";
}

}  // namespace rugae
