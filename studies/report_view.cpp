#include "studies/report_view.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/files.h"
#include "dataset/colours.h"
#include "dataset/label_images.h"
#include "studies/gates.h"
#include "studies/html.h"
#include "studies/packed.h"
#include "studies/simplify.h"
#include "validate/metrics_json.h"

namespace rugae {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

// Of the whole page; a triangle takes about 13 bytes of it, a frame with its labels 25 to 40
// thousand.
constexpr std::size_t kTriangles = 500'000, kStops = 500;
constexpr std::size_t kMostTriangles = 60'000, kFewestTriangles = 5'000;
constexpr std::size_t kMostStops = 90, kFewestStops = 8;
constexpr int kQuality = 80;

// Of the script with its geometry.
std::string id_of(const TriangleMesh& mesh) {
  std::string bytes(reinterpret_cast<const char*>(mesh.vertices.data()),
                    mesh.vertices.size() * sizeof(Vec3));
  bytes.append(reinterpret_cast<const char*>(mesh.triangles.data()),
               mesh.triangles.size() * sizeof(Vec3i));
  constexpr std::size_t kLetters = 12;
  return "wall-" + sha256_of_bytes(bytes).substr(0, kLetters);
}

Json pose_json(const Rigid3& world_from_camera) {
  const Quat& q = world_from_camera.rotation;
  const Vec3& t = world_from_camera.translation;
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

// Frames in equal steps, the first and the last among them.
std::vector<int> stops_of(int frames, int most) {
  const int count = std::min(frames, most);
  std::vector<int> stops;
  for (int k = 0; k < count; ++k)
    stops.push_back(count == 1 ? 0
                               : static_cast<int>(std::lround(k * (frames - 1.0) / (count - 1))));
  return stops;
}

// Unit rays of the image's corners, clockwise from the first pixel's; empty where the lens has no
// ray there.
Json corner_rays(const Lens& lens) {
  Json rays = Json::array();
  for (const Vec2& corner :
       {Vec2(0, 0), Vec2(lens.width, 0), Vec2(lens.width, lens.height), Vec2(0, lens.height)}) {
    const auto ray = lens.unproject(corner);
    if (!ray) return Json::array();
    rays.push_back({ray->x(), ray->y(), ray->z()});
  }
  return rays;
}

Json error_colours() {
  constexpr int kColours = 33;
  Json colours = Json::array();
  for (int i = 0; i < kColours; ++i) {
    const Vec3f c = error_colour(i / (kColours - 1.0));
    colours.push_back({c[0], c[1], c[2]});
  }
  return colours;
}

// Values of the full mesh's vertices at those of one with fewer.
std::vector<double> carried(const std::vector<double>& values, const TriangleMesh& full,
                            const TriangleMesh& few) {
  const ClosestPoint closest(full);
  std::vector<double> out(few.vertices.size());
  tbb::parallel_for(std::size_t{0}, few.vertices.size(), [&](std::size_t v) {
    const SurfacePoint at = closest(few.vertices[v]);
    const Vec3i& corners = full.triangles[at.triangle];
    for (int k = 0; k < 3; ++k) out[v] += at.barycentric[k] * values[corners[k]];
  });
  return out;
}

// 1 at the vertices of a simplified wall that lie on a triangle that was seen.
std::vector<double> seen_vertices(const Visibility& visibility, const TriangleMesh& wall,
                                  const TriangleMesh& few) {
  const ClosestPoint closest(wall);
  std::vector<double> out(few.vertices.size());
  tbb::parallel_for(std::size_t{0}, few.vertices.size(), [&](std::size_t v) {
    out[v] = visibility.seen()[closest(few.vertices[v]).triangle] > 0 ? 1.0 : 0.0;
  });
  return out;
}

Json pictures_json(const CellView& view, const FramePictures& pictures, int frame) {
  const int frame_width_px = view.many_cells ? 320 : 400, label_width_px = frame_width_px / 2;
  Json uris = {{"frame", html::jpeg(pictures.observation(frame), frame_width_px, kQuality)}};
  for (const LabelImage& label : label_images())
    if (has_label(view, label.name, frame))
      uris[label.name] = html::jpeg(pictures.label(label.name, frame), label_width_px, kQuality);
  return uris;
}

Json stops_json(const CellView& view, const FramePictures& pictures,
                const std::vector<int>& stops) {
  const auto to_truth = transform_from_json(metric_at(view.cell.metrics, "alignment"));
  const PathPlot path = path_plot(view);
  std::vector<Json> out(stops.size());
  tbb::parallel_for(std::size_t{0}, stops.size(), [&](std::size_t k) {
    const auto i = static_cast<std::size_t>(stops[k]);
    const bool tracked = to_truth && path.estimate_mm[i].allFinite();
    out[k] = {
        {"index", stops[k]},
        {"pose", pose_json(view.truth.track()[i].world_from_camera)},
        {"estimate", tracked ? pose_json(*to_truth * view.estimate.world_from_camera[i]) : Json()},
        {"pictures", pictures_json(view, pictures, stops[k])}};
  });
  return out;
}

// What the colours of a label mean, in a few words.
std::string key_of(const LabelImage& label, const FramePictures& pictures) {
  const std::string name = label.name;
  if (name == "depth")
    return fmt::format("bright {:g} to dark {:g} mm", pictures.nearest_mm(),
                       pictures.farthest_mm());
  if (name == "flow") return fmt::format("full colour: {:g} px", pictures.longest_flow_px());
  if (name == "normals") return "red right, green up, blue to the camera";
  if (name == "masks") return "yellow reflects, red saturated, blue leaves, violet hidden next";
  return label.what;
}

Json labels_json(const CellView& view, const FramePictures& pictures) {
  Json labels = Json::array();
  for (const LabelImage& label : label_images())
    if (has_label(view, label.name, 0) || has_label(view, label.name, 1))  // some lack one end
      labels.push_back({{"name", label.name}, {"key", key_of(label, pictures)}});
  return labels;
}

}  // namespace

ReportViews::ReportViews(std::size_t cells)
    : triangles_(std::clamp(kTriangles / std::max<std::size_t>(cells, 1), kFewestTriangles,
                            kMostTriangles)),
      stops_(static_cast<int>(
          std::clamp(kStops / std::max<std::size_t>(cells, 1), kFewestStops, kMostStops))) {}

void ReportViews::add_wall(const TriangleMesh& wall) {
  const std::string id = id_of(wall);
  if (!walls_.contains(id)) walls_.emplace(id, simplified(wall, triangles_));
}

std::string ReportViews::walls() const {
  std::string out;
  for (const auto& [id, few] : walls_) {
    Json geometry = packed::mesh(few);
    geometry["id"] = id;
    out += html::json_script("wall-data", geometry.dump());
  }
  return out;
}

std::string ReportViews::part(const CellView& view, const MapOverTruth& over,
                              const FramePictures& pictures) const {
  const TriangleMesh& full_wall = view.truth.wall();
  const std::string wall_id = id_of(full_wall);
  const TriangleMesh& wall = walls_.at(wall_id);

  const PathPlot path = path_plot(view);
  std::vector<double> time_s;
  for (const TimedPose& pose : view.truth.track()) time_s.push_back(pose.time_s);
  Json data = {{"title", view.cell.cell.title()},
               {"wall",
                {{"id", wall_id},
                 {"moves", fs::exists(DatasetLayout{view.cell.dataset}.wall_motion(0))},
                 {"seen", packed::shares(seen_vertices(over.visibility, full_wall, wall), 1.0)}}},
               {"map", Json()},
               {"error_colours", error_colours()},
               {"corner_rays", corner_rays(view.truth.camera().lens)},
               {"path",
                {{"time_s", packed::floats(time_s)},
                 {"truth_mm", packed::points(path.truth_mm)},
                 {"estimate_mm", packed::points(path.estimate_mm)},
                 {"error_mm", packed::floats(path.error_mm)},
                 {"worst_mm", path.worst_mm}}},
               {"labels", labels_json(view, pictures)},
               {"stops", stops_json(view, pictures, stops_of(view.truth.size(), stops_))}};
  if (over.has_map()) {
    const TriangleMesh few = simplified(over.map, triangles_);
    data["map"] = packed::mesh(few);
    data["map"]["error"] = packed::shares(carried(over.error_mm, over.map, few), over.worst_mm);
    data["map"]["worst_mm"] = over.worst_mm;
  }
  return "<div class=\"view\">" + html::json_script("view-data", data.dump()) + "</div>\n";
}

}  // namespace rugae
