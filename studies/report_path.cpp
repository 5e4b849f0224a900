// The estimated path over the true one.

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/units.h"
#include "dataset/colours.h"
#include "studies/html.h"
#include "studies/plots.h"
#include "studies/report_parts.h"

namespace rugae {
namespace {

using nlohmann::json;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> numbers(const json& list) {
  std::vector<double> out;
  for (const json& value : list) out.push_back(value.is_number() ? value.get<double>() : kNan);
  return out;
}

std::vector<Vec3> points(const json& list) {
  std::vector<Vec3> out;
  for (const json& p : list)
    out.push_back(p.is_array() ? Vec3(p[0], p[1], p[2]) : Vec3(Vec3::Constant(kNan)));
  return out;
}

}  // namespace

PathPlot path_plot(const CellView& view) {
  if (!view.cell.metrics.contains("frames")) {
    PathPlot plot;
    for (const TimedPose& pose : view.truth.track())
      plot.truth_mm.push_back(pose.world_from_camera.translation);
    plot.estimate_mm.assign(plot.truth_mm.size(), Vec3::Constant(kNan));
    plot.error_mm.assign(plot.truth_mm.size(), kNan);
    return plot;
  }
  const json& frames = view.cell.metrics.at("frames");
  PathPlot plot{points(frames.at("truth_mm")), points(frames.at("estimate_mm")),
                numbers(frames.at("position_error_mm")), 1.0};
  double worst = 0.0;
  for (const double e : plot.error_mm)
    if (std::isfinite(e)) worst = std::max(worst, e);
  const double step = nice_step(std::max(worst, 1e-6), 4);
  plot.worst_mm = step * std::max(1.0, std::ceil(worst / step));
  return plot;
}

std::string path_part(const CellView& view) {
  const json& frames = view.cell.metrics.at("frames");
  const PathPlot plot = path_plot(view);
  std::string out = "<div class=\"sides\">";
  for (const Side& side : two_sides())
    out += "<figure>" + path_svg(plot, view.truth.wall(), side) + "<figcaption>Seen " + side.name +
           ".</figcaption></figure>";
  out += "</div>\n";
  out += fmt::format(
      "<div class=\"legend\"><span class=\"line true\"></span>true path"
      "<span class=\"line estimated\"></span>estimated path, aligned by Sim(3)"
      "<span class=\"gap\"></span>error of each frame, 0 <span class=\"bar inline\" "
      "style=\"background:{}\"></span> {:g} mm</div>\n",
      error_gradient_css(), plot.worst_mm);

  const std::vector<double> time_s = numbers(frames.at("time_s"));
  std::vector<double> keyframes_s;
  for (std::size_t i = 0; i < time_s.size(); ++i)
    if (frames.at("state")[i] == "keyframe") keyframes_s.push_back(time_s[i]);
  out += "<figure class=\"wide\">" +
         time_svg({"Position error", "mm", time_s, plot.error_mm, keyframes_s});
  std::vector<double> degrees = numbers(frames.at("rotation_error_rad"));
  for (double& r : degrees) r = deg_from_rad(r);
  out += time_svg({"Rotation error", "degrees", time_s, degrees, keyframes_s});
  const int lost = view.cell.metrics.at("tracking").at("lost");
  out += fmt::format(
      "<figcaption>Error of every frame over time, after one Sim(3) alignment of the whole path. "
      "Ticks: key frames.{}</figcaption></figure>\n",
      lost > 0 ? fmt::format(" Shaded: the {} lost frames.", lost) : " No frame was lost.");
  const std::string note = view.cell.metrics.at("trajectory").at("note");
  if (!note.empty()) out = "<p class=\"note\">" + html::escape(note) + "</p>\n" + out;
  return out;
}

}  // namespace rugae
