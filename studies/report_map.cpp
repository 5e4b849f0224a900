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

using Colours = std::vector<Vec3f>;  // of a mesh's vertices

Colours colours_of_seen(const TriangleMesh& wall, const Visibility& visibility) {
  Colours colours(wall.vertices.size(), kUnseen_srgb);
  for (std::size_t t = 0; t < wall.triangles.size(); ++t)
    if (visibility.seen()[t] > 0)
      for (const int v : wall.triangles[t]) colours[v] = kSeen_srgb;
  return colours;
}

Colours colours_of_errors(const std::vector<double>& error_mm, double worst_mm) {
  Colours colours;
  for (const double error : error_mm) colours.push_back(error_colour(error / worst_mm));
  return colours;
}

std::vector<ColouredView> views_into(const TriangleMesh& mesh,
                                     const std::vector<Colours>& colourings,
                                     const Eigen::AlignedBox3d& box, const Side& side,
                                     float background) {
  const Lens lens = picture_lens(kWidth_px, kHeight_px);
  ShadedViewOptions options;
  options.cull_front = true;  // the near side is left out: the eye looks into the organ
  options.background_srgb = Vec3f::Constant(background);
  return coloured_views(mesh, colourings, view_of_box(box, side.from, side.up, lens), lens,
                        options);
}

// The map, seen on black, over a pale wall. What lies before what does not matter: the map is
// always shown.
cv::Mat map_over_wall(const ColouredView& map, const cv::Mat& wall) {
  constexpr double kPale = 0.72;
  cv::Mat picture(wall.size(), CV_8UC3);
  for (int y = 0; y < wall.rows; ++y)
    for (int x = 0; x < wall.cols; ++x)
      for (int c = 0; c < 3; ++c) {
        const double open = 1.0 - map.covered.at<float>(y, x);
        const double pale = 255.0 * kPale + (1.0 - kPale) * wall.at<cv::Vec3b>(y, x)[c];
        picture.at<cv::Vec3b>(y, x)[c] =
            cv::saturate_cast<unsigned char>(map.bgr.at<cv::Vec3b>(y, x)[c] + open * pale);
      }
  return picture;
}

std::string figure(const cv::Mat& image, const Side& side, const std::string& alt,
                   const std::string& caption) {
  return html::figure(html::jpeg(image, kWidth_px, 88), alt + ", " + side.name, caption);
}

}  // namespace

std::string map_part(const CellView& view, const MapOverTruth& over) {
  TriangleMesh wall = view.truth.wall();
  if (wall.normals.empty()) wall.normals = angle_weighted_normals(wall);
  const Eigen::AlignedBox3d box = bounding_box(wall);
  std::string out;
  const std::string note = view.cell.metrics.at("surface").at("note");
  if (!note.empty()) out += "<p class=\"note\">" + html::escape(note) + "</p>";

  const TriangleMesh& map = over.map;
  std::vector<Colours> wall_colours{colours_of_seen(wall, over.visibility)}, map_colours;
  if (over.has_map()) {
    wall_colours.emplace_back();  // clay
    map_colours = {map.colors, colours_of_errors(over.error_mm, over.worst_mm)};
  }
  out += fmt::format("<div class=\"maps\" style=\"--columns:{}\">", over.has_map() ? 3 : 1);
  for (const Side& side : two_sides()) {
    const std::vector<ColouredView> walls = views_into(wall, wall_colours, box, side, 1.0f);
    out += figure(walls[0].bgr, side, "true wall",
                  "The true wall, " + side.name +
                      ", looking in through the near side. Rose: seen by the capsule; gray: never "
                      "seen.");
    if (!over.has_map()) continue;
    const std::vector<ColouredView> maps = views_into(map, map_colours, box, side, 0.0f);
    out += figure(map_over_wall(maps[0], walls[1].bgr), side, "reconstructed map",
                  "The reconstructed map in its own colours, over the true wall (pale).");
    out += figure(map_over_wall(maps[1], walls[1].bgr), side, "map coloured by error",
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
