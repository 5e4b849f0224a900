// nerfstudio. Camera axes are OpenGL's: x right, y up, z back. Pixel centres are ours.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/mesh_io.h"
#include "dataset/export/formats.h"
#include "dataset/export/points.h"
#include "dataset/image_io.h"

namespace rugae {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDepthPerMm = 200.0;  // up to 327 mm in 16 bits
constexpr double kMetresPerMm = 1e-3;

// Columns of y and z negated: the camera's axes, not the world's.
Json opengl_matrix(const Rigid3& world_from_camera) {
  const auto m = world_from_camera.matrix3x4();
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({m(i, 0), -m(i, 1), -m(i, 2), kMetresPerMm * m(i, 3)});
  rows.push_back({0.0, 0.0, 0.0, 1.0});
  return rows;
}

Json camera_of(const Lens& lens) {
  const bool fisheye = lens.model == LensModel::kannala_brandt;
  Json camera = {{"camera_model", fisheye ? "OPENCV_FISHEYE" : "OPENCV"},
                 {"w", lens.width},
                 {"h", lens.height},
                 {"fl_x", lens.fx},
                 {"fl_y", lens.fy},
                 {"cx", lens.cx},
                 {"cy", lens.cy},
                 {"k1", lens.k1},
                 {"k2", lens.k2},
                 {"k3", lens.k3}};
  if (fisheye)
    camera["k4"] = lens.k4;
  else
    camera.update({{"p1", lens.p1}, {"p2", lens.p2}});
  return camera;
}

// Where splats begin.
TriangleMesh points_in_metres(const WallPoints& wall) {
  TriangleMesh points;
  for (const ColouredPoint& point : wall.points()) {
    points.vertices.push_back(kMetresPerMm * point.place_mm);
    points.colors.push_back(Vec3f(point.color[0], point.color[1], point.color[2]) / 255.0f);
  }
  return points;
}

}  // namespace

std::vector<std::string> export_nerfstudio(const ExportSource& source, Progress& progress) {
  const bool depth = source.info.truth.labels.depth;
  const bool stopped = source.lens().stop.shape != StopShape::full;
  // Its rays of a fisheye are unit vectors, those of a pinhole have z = 1: depth goes with them.
  const DepthCode code{source.depth_per_mm > 0.0 ? source.depth_per_mm : kDepthPerMm,
                       source.lens().model == LensModel::kannala_brandt};
  std::vector<std::string> notes;
  const auto names =
      write_frames(source, "images", depth ? std::optional(code) : std::nullopt, progress, notes);
  if (stopped) write_image(source.out / "mask.png", stop_mask(source.lens()));

  const WallPoints wall(source, progress);
  progress.begin("transforms.json");
  Json transforms = camera_of(source.lens());
  if (!wall.points().empty()) {
    write_ply(source.out / "points.ply", points_in_metres(wall), false, "m");
    transforms["ply_file_path"] = "points.ply";
  }
  for (int frame = 0; frame < source.frames(); ++frame) {
    Json entry = {{"file_path", "images/" + names[frame]},
                  {"transform_matrix", opengl_matrix(source.world_from_camera(frame))}};
    if (depth) entry["depth_file_path"] = fmt::format("depth/{:06}.png", frame);
    if (stopped) entry["mask_path"] = "mask.png";
    transforms["frames"].push_back(std::move(entry));
  }
  write_atomic(source.out / "transforms.json", transforms.dump(1) + "\n");
  if (depth)
    notes.push_back(fmt::format("{}: --depth-unit-scale-factor {:.9g}", code.text(),
                                kMetresPerMm / code.per_mm));
  return notes;
}

}  // namespace rugae
