// The map over the true wall.

#include <nlohmann/json.hpp>

#include "core/check.h"
#include "dataset/colours.h"
#include "render/shaded_view.h"
#include "studies/html.h"
#include "studies/map_over_truth.h"
#include "studies/plots.h"
#include "studies/report_parts.h"
#include "validate/surface_error.h"

namespace rugae {
namespace {

constexpr int kWidth_px = 620, kHeight_px = 560;
const Vec3f kSeen_srgb(0.86f, 0.55f, 0.47f), kUnseen_srgb(0.58f, 0.60f, 0.64f);

TriangleMesh wall_with_seen_part(const TriangleMesh& wall, const Visibility& visibility) {
  TriangleMesh coloured = wall;
  coloured.colors.assign(wall.vertices.size(), kUnseen_srgb);
  for (std::size_t t = 0; t < wall.triangles.size(); ++t)
    if (visibility.seen()[t] > 0)
      for (const int v : wall.triangles[t]) coloured.colors[v] = kSeen_srgb;
  if (coloured.normals.empty()) coloured.normals = angle_weighted_normals(coloured);
  return coloured;
}

TriangleMesh coloured_by_error(const TriangleMesh& map, const std::vector<double>& error_mm,
                               double worst_mm) {
  TriangleMesh coloured = map;
  coloured.colors.resize(map.vertices.size());
  for (std::size_t v = 0; v < map.vertices.size(); ++v)
    coloured.colors[v] = error_colour(error_mm[v] / worst_mm);
  if (coloured.normals.empty()) coloured.normals = angle_weighted_normals(coloured);
  return coloured;
}

cv::Mat view_into(const TriangleMesh& mesh, const Eigen::AlignedBox3d& box, const Side& side,
                  float background) {
  const Lens lens = picture_lens(kWidth_px, kHeight_px);
  ShadedViewOptions options;
  options.cull_front = true;  // the near side is left out: the eye looks into the organ
  options.background_srgb = Vec3f::Constant(background);
  return shaded_view(mesh, view_of_box(box, side.from, side.up, lens), lens, options);
}

// The map over a pale wall. What lies before what does not matter: the map is always shown. Its
// share a of a pixel follows from two backgrounds: a m + (1 - a) b on white less the same on black
// is (1 - a) white.
cv::Mat map_over_wall(const TriangleMesh& map, const cv::Mat& wall, const Eigen::AlignedBox3d& box,
                      const Side& side) {
  const cv::Mat on_white = view_into(map, box, side, 1.0f), on_black = view_into(map, box, side, 0);
  constexpr double kPale = 0.72;
  cv::Mat picture(wall.size(), CV_8UC3);
  for (int y = 0; y < wall.rows; ++y)
    for (int x = 0; x < wall.cols; ++x)
      for (int c = 0; c < 3; ++c) {
        const double dark = on_black.at<cv::Vec3b>(y, x)[c];
        const double open = (on_white.at<cv::Vec3b>(y, x)[c] - dark) / 255.0;
        const double pale = 255.0 * kPale + (1.0 - kPale) * wall.at<cv::Vec3b>(y, x)[c];
        picture.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<unsigned char>(dark + open * pale);
      }
  return picture;
}

std::string figure(const cv::Mat& image, const Side& side, const std::string& alt,
                   const std::string& caption) {
  return html::figure(html::jpeg(image, kWidth_px, 88), alt + ", " + side.name, caption);
}

}  // namespace

std::string map_part(const CellView& view, const MapOverTruth& over) {
  const TriangleMesh wall = wall_with_seen_part(view.truth.wall(), over.visibility);
  const Eigen::AlignedBox3d box = bounding_box(wall);
  std::string out;
  const std::string note = view.cell.metrics.at("surface").at("note");
  if (!note.empty()) out += "<p class=\"note\">" + html::escape(note) + "</p>";

  const TriangleMesh& map = over.map;
  TriangleMesh errors;
  if (over.has_map()) errors = coloured_by_error(map, over.error_mm, over.worst_mm);
  out += fmt::format("<div class=\"maps\" style=\"--columns:{}\">", over.has_map() ? 3 : 1);
  TriangleMesh clay = wall;
  clay.colors.clear();
  for (const Side& side : two_sides()) {
    out += figure(view_into(wall, box, side, 1.0f), side, "true wall",
                  "The true wall, " + side.name +
                      ", looking in through the near side. Rose: seen by the capsule; gray: never "
                      "seen.");
    if (!over.has_map()) continue;
    const cv::Mat shape = view_into(clay, box, side, 1.0f);
    out += figure(map_over_wall(map, shape, box, side), side, "reconstructed map",
                  "The reconstructed map in its own colours, over the true wall (pale).");
    out += figure(map_over_wall(errors, shape, box, side), side, "map coloured by error",
                  "The map coloured by its distance to the wall that was seen.");
  }
  out += "</div>\n";
  if (!over.has_map()) return out;
  out += fmt::format(
      "<div class=\"legend\">distance to the true wall: 0 <span class=\"bar inline\" "
      "style=\"background:{}\"></span> {:g} mm and more</div>\n",
      error_gradient_css(), over.worst_mm);

  constexpr std::size_t kSamples = 20'000;
  const auto of_map = distances_mm(sample_surface(map, kSamples), over.seen_wall);
  const auto of_wall = distances_mm(sample_surface(over.seen_wall, kSamples), map);
  out += "<figure class=\"half\">" +
         cumulative_svg({{"map", "a", of_map}, {"wall", "b", of_wall}}, 2.0 * over.worst_mm) +
         "<figcaption><span class=\"line a\"></span>share of the map within a distance of the seen "
         "wall (accuracy) <span class=\"line b\"></span>share of the seen wall within a distance "
         "of the map (completeness)</figcaption></figure>\n";
  return out;
}

}  // namespace rugae
