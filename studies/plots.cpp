#include "studies/plots.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "dataset/colours.h"
#include "studies/html.h"

namespace rugae {
namespace {

// Places on the paper, in SVG units, from values.
struct Axis {
  double low, high, begin, end;
  double operator()(double value) const {
    return begin + (value - low) / (high - low) * (end - begin);
  }
};

std::string css(const Vec3f& srgb) {
  const auto byte = [](float v) { return static_cast<int>(std::lround(255.0f * v)); };
  return fmt::format("rgb({},{},{})", byte(srgb[0]), byte(srgb[1]), byte(srgb[2]));
}

// The outer contour of the wall as SVG path data: filled triangles on a small raster, then its
// outline.
std::string outline(const TriangleMesh& wall, const Side& side, const Axis& x, const Axis& y) {
  constexpr double kRaster = 2.0;  // raster cells an SVG unit
  std::vector<cv::Point> corners;
  int width = 1, height = 1;
  for (const Vec3& v : wall.vertices) {
    corners.emplace_back(static_cast<int>(std::lround(kRaster * x(v.dot(side.right)))),
                         static_cast<int>(std::lround(kRaster * y(v.dot(side.up)))));
    width = std::max(width, corners.back().x + 2);
    height = std::max(height, corners.back().y + 2);
  }
  cv::Mat mask(height, width, CV_8U, cv::Scalar(0));
  for (const Vec3i& t : wall.triangles) {
    const std::array<cv::Point, 3> triangle{corners[t[0]], corners[t[1]], corners[t[2]]};
    cv::fillConvexPoly(mask, triangle.data(), 3, cv::Scalar(255));
  }
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::string data;
  for (const auto& contour : contours) {
    std::vector<cv::Point> few;
    cv::approxPolyDP(contour, few, 1.0, true);
    if (few.size() < 3) continue;
    for (std::size_t i = 0; i < few.size(); ++i)
      data += fmt::format("{}{:.1f} {:.1f}", i == 0 ? "M" : "L", few[i].x / kRaster,
                          few[i].y / kRaster);
    data += "Z";
  }
  return data;
}

// Path data through finite points, with a new start after every gap.
template <typename PointOf>
std::string line_data(std::size_t count, PointOf&& point_of) {
  std::string data;
  bool pen_down = false;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec2 p = point_of(i);
    if (p.allFinite()) data += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", p.x(), p.y());
    pen_down = p.allFinite();
  }
  return data;
}

std::string svg_begin(double width, double height, const std::string& label) {
  return fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\">\n", width,
                     height, html::escape(label));
}

}  // namespace

double nice_step(double span, int parts) {
  if (!(span > 0.0)) return 1.0;
  const double raw = span / parts, power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (raw <= factor * power * (1.0 + 1e-9)) return factor * power;
  return 10.0 * power;
}

std::vector<Side> two_sides() {
  return {{"from the front", -Vec3::UnitY(), Vec3::UnitX(), Vec3::UnitZ()},
          {"from the patient's left", Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()}};
}

std::string path_svg(const PathPlot& plot, const TriangleMesh& wall, const Side& side) {
  constexpr double kSize = 460.0, kBorder = 14.0, kFoot = 26.0;
  Eigen::AlignedBox2d box;
  const auto flat = [&](const Vec3& p) { return Vec2(p.dot(side.right), p.dot(side.up)); };
  for (const Vec3& v : wall.vertices) box.extend(flat(v));
  for (const Vec3& p : plot.truth_mm) box.extend(flat(p));
  // A wild estimate may not squeeze the picture: it is drawn as far as the picture goes.
  // One scale for all sides.
  const double units_per_mm = (kSize - 2 * kBorder) / bounding_box(wall).sizes().maxCoeff();
  const double width = 2 * kBorder + units_per_mm * box.sizes().x();
  const double height = 2 * kBorder + kFoot + units_per_mm * box.sizes().y();
  const Axis x{box.min().x(), box.max().x(), kBorder, width - kBorder};
  const Axis y{box.min().y(), box.max().y(), height - kBorder - kFoot, kBorder};
  const auto at = [&](const Vec3& p) { return Vec2(x(flat(p).x()), y(flat(p).y())); };

  std::string out = fmt::format("<div style=\"width:{:.0f}px;max-width:100%\">", width) +
                    svg_begin(width, height, "true and estimated path, seen " + side.name);
  out += "<path class=\"organ\" d=\"" + outline(wall, side, x, y) + "\"/>\n";
  for (std::size_t i = 0; i < plot.truth_mm.size(); ++i) {
    if (!plot.estimate_mm[i].allFinite()) continue;
    const Vec2 a = at(plot.truth_mm[i]), b = at(plot.estimate_mm[i]);
    out += fmt::format(
        "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"{}\" stroke-width=\"1\" "
        "opacity=\".55\"/>",
        a.x(), a.y(), b.x(), b.y(), css(error_colour(plot.error_mm[i] / plot.worst_mm)));
  }
  out +=
      "\n<path class=\"true-path\" d=\"" +
      line_data(plot.truth_mm.size(), [&](std::size_t i) { return at(plot.truth_mm[i]); }) +
      "\"/>\n<path class=\"estimated-path\" d=\"" +
      line_data(plot.estimate_mm.size(), [&](std::size_t i) { return at(plot.estimate_mm[i]); }) +
      "\"/>\n";
  if (!plot.truth_mm.empty()) {
    const Vec2 start = at(plot.truth_mm.front());
    out += fmt::format("<circle class=\"start\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>\n", start.x(),
                       start.y());
  }
  constexpr double kBar_mm = 50.0;
  out += fmt::format(
      "<path class=\"axis\" d=\"M{0:.1f} {1:.1f}h{2:.1f}\" stroke-width=\"2\"/>"
      "<text x=\"{3:.1f}\" y=\"{4:.1f}\">{5:g} mm</text></svg></div>\n",
      kBorder, height - 12, units_per_mm * kBar_mm, kBorder + units_per_mm * kBar_mm + 6,
      height - 8, kBar_mm);
  return out;
}

std::string time_svg(const TimePlot& plot) {
  constexpr double kWidth = 960, kHeight = 210, kLeft = 46, kRight = 10, kTop = 22, kBottom = 30;
  double top = 0.0;
  for (const double v : plot.value)
    if (std::isfinite(v)) top = std::max(top, v);
  const double step = nice_step(std::max(top, 1e-9), 4);
  const Axis y{0.0, step * std::max(1.0, std::ceil(top / step)), kHeight - kBottom, kTop};
  const double last_s = plot.time_s.empty() ? 1.0 : std::max(plot.time_s.back(), 1e-9);
  const Axis x{0.0, last_s, kLeft, kWidth - kRight};
  std::string out = svg_begin(kWidth, kHeight, plot.title);
  for (double v = 0.0; v <= y.high * 1.0001; v += step)
    out += fmt::format(
        "<path class=\"grid\" d=\"M{0} {1:.1f}H{2}\"/><text class=\"left\" x=\"{3}\" "
        "y=\"{4:.1f}\">{5:g}</text>\n",
        kLeft, y(v), kWidth - kRight, kLeft - 6, y(v) + 4, v);
  const double step_s = nice_step(last_s, 8);
  for (double t = 0.0; t <= last_s * 1.0001; t += step_s)
    out += fmt::format("<text class=\"middle\" x=\"{:.1f}\" y=\"{}\">{:g} s</text>", x(t),
                       kHeight - 6, t);
  // Lost frames, as a shade behind the curve.
  for (std::size_t i = 0; i < plot.value.size(); ++i) {
    if (std::isfinite(plot.value[i])) continue;
    const double half = 0.5 * last_s / std::max<std::size_t>(plot.value.size(), 1);
    out +=
        fmt::format("<rect class=\"lost\" x=\"{:.1f}\" y=\"{}\" width=\"{:.2f}\" height=\"{}\"/>",
                    x(plot.time_s[i] - half), kTop, x(2 * half) - x(0), kHeight - kBottom - kTop);
  }
  for (const double t : plot.marks_s)
    out += fmt::format("<path class=\"mark\" d=\"M{:.1f} {}v5\"/>", x(t), kHeight - kBottom);
  const auto point = [&](std::size_t i) { return Vec2(x(plot.time_s[i]), y(plot.value[i])); };
  out += "\n<path class=\"curve\" d=\"" + line_data(plot.value.size(), point) + "\"/>\n";
  return out + fmt::format("<text class=\"title\" x=\"{}\" y=\"13\">{} ({})</text></svg>\n", kLeft,
                           html::escape(plot.title), html::escape(plot.unit));
}

std::string cumulative_svg(const std::vector<Curve>& curves, double longest_mm) {
  constexpr double kWidth = 460, kHeight = 260, kLeft = 46, kRight = 12, kTop = 12, kBottom = 34;
  constexpr int kPoints = 120;
  const Axis x{0.0, longest_mm, kLeft, kWidth - kRight}, y{0.0, 1.0, kHeight - kBottom, kTop};
  std::string out = svg_begin(kWidth, kHeight, "share of the surface within a distance");
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
    out += fmt::format(
        "<path class=\"grid\" d=\"M{0} {1:.1f}H{2}\"/><text class=\"left\" x=\"{3}\" "
        "y=\"{4:.1f}\">{5:.0f}&#8202;%</text>",
        kLeft, y(share), kWidth - kRight, kLeft - 6, y(share) + 4, 100 * share);
  const double step = nice_step(longest_mm, 5);
  for (double d = 0.0; d <= longest_mm * 1.0001; d += step)
    out += fmt::format("<text class=\"middle\" x=\"{:.1f}\" y=\"{}\">{:g} mm</text>", x(d),
                       kHeight - 10, d);
  for (const Curve& curve : curves) {
    std::vector<double> sorted = curve.distances_mm;
    std::ranges::sort(sorted);
    const auto point = [&](std::size_t i) {
      const double d = longest_mm * i / kPoints;
      const auto within = std::ranges::upper_bound(sorted, d) - sorted.begin();
      return Vec2(x(d), y(static_cast<double>(within) / std::max<std::size_t>(sorted.size(), 1)));
    };
    out += fmt::format("\n<path class=\"curve {}\" d=\"{}\"/>", curve.css_class,
                       line_data(kPoints + 1, point));
  }
  return out + "</svg>\n";
}

}  // namespace rugae
