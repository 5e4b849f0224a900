#include "scenes/scene.h"

#include <algorithm>
#include <cctype>

#include "core/check.h"
#include "core/presets.h"
#include "core/yaml.h"
#include "scenes/chessboard.h"
#include "scenes/deformation.h"
#include "scenes/import.h"
#include "scenes/instances.h"
#include "scenes/long_axis.h"
#include "scenes/region_tint.h"
#include "scenes/scene_file.h"
#include "scenes/stomach.h"

namespace rugae {
namespace {

// Grid cells that give about 50k, 250k and 1M triangles: 3 A / cell^2 for the smooth wall's area of
// about 73,000 mm^2 (scale 1).
constexpr double kCellMm[] = {2.12, 0.96, 0.475};
const std::vector<std::string> kResolutions = {"coarse", "medium", "fine"};

// Along a stomach's own axis, or along the wall's longest way with a stomach's proportions.
OrganMotion find_motion(const SceneFile& file, std::uint64_t seed, const TriangleMesh& wall) {
  const DeformationOptions& options = file.deformation;
  if (!options.peristalsis && !options.breathing) return {};
  if (file.kind == SceneKind::procedural) {
    const StomachShape shape(file.stomach, seed);
    return make_motion(options, shape.peristalsis_zone(), shape.axis(), wall.vertices);
  }
  const OrganAxis axis = long_axis(wall);
  const double length = axis.length_mm();
  const PeristalsisZone zone{.rise_from_mm = 0.3 * length,
                             .rise_to_mm = 0.7 * length,
                             .fall_from_mm = 0.85 * length,
                             .fall_to_mm = length};
  return make_motion(options, zone, axis, wall.vertices);
}

Scene board_scene(const SceneFile& file, const std::string& name, std::uint64_t seed) {
  const auto board = std::make_shared<const Chessboard>(file.board);
  Scene scene{.name = name,
              .wall = board->mesh(),
              .rest_positions = {},
              .regions = {},
              .instances = std::make_shared<const Instances>(std::vector<WallInstance>{}),
              .mucosa = Mucosa(file.mucosa, seed),
              .board = board,
              .motion = {},
              .motion_reach_mm = 0.0,
              .seed = seed,
              .notes = {},
              .resolved_yaml = resolved_yaml(file)};
  scene.rest_positions = scene.wall.vertices;
  scene.regions.assign(scene.wall.vertices.size(), Region::unknown);
  return scene;
}

bool is_mesh_file(const std::string& name_or_path) {
  std::string extension = std::filesystem::path(name_or_path).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return !extension.empty() && extension != ".yaml" && extension != ".yml";
}

}  // namespace

int Scene::instance_at(const Vec3f& rest_position_mm) const {
  if (!instances) return 0;
  const Instances::Hit hit = instances->at(rest_position_mm.cast<double>());
  return hit.instance ? hit.instance->id : 0;
}

Scene load_scene(const SceneRequest& request) {
  const auto resolution = std::ranges::find(kResolutions, request.resolution);
  check(resolution != kResolutions.end(),
        "resolution is '{}', expected one of: coarse, medium, fine{}", request.resolution,
        did_you_mean(request.resolution, kResolutions));
  const int level = static_cast<int>(resolution - kResolutions.begin());
  check(request.oil >= 0.0 && request.oil <= 1.0, "oil is {}, expected 0 to 1", request.oil);

  SceneFile file;
  if (is_mesh_file(request.name_or_path)) {
    file.kind = SceneKind::mesh;
    file.mesh = request.name_or_path;
  } else {
    file = read_scene_file(find_preset("scenes", "scene", request.name_or_path), request.seed);
  }
  const std::string name = std::filesystem::path(request.name_or_path).stem().string();
  if (file.kind == SceneKind::chessboard) return board_scene(file, name, request.seed);
  file.mucosa.oil = std::max(file.mucosa.oil, request.oil);
  ImportedWall wall;
  std::vector<Region> regions;
  std::shared_ptr<const RegionTint> tint;
  std::vector<WallInstance> instances;
  if (file.kind == SceneKind::mesh) {
    wall = import_wall(file.mesh, file.import, request.seed, level);
    regions.assign(wall.mesh.vertices.size(), Region::unknown);
  } else {
    StomachWall stomach =
        make_stomach(file.stomach, request.seed, kCellMm[level] * file.stomach.scale);
    wall.mesh = std::move(stomach.mesh);
    regions = std::move(stomach.regions);
    instances = std::move(stomach.instances);
    const StomachShape shape(file.stomach, request.seed);
    tint = std::make_shared<RegionTint>(
        shape.box(), [&](const Vec3& p) { return shape.region(p, shape.locate(p)); });
  }
  const auto shared = std::make_shared<const Instances>(std::move(instances));
  OrganMotion motion = find_motion(file, request.seed, wall.mesh);
  Scene scene{.name = name,
              .wall = std::move(wall.mesh),
              .rest_positions = {},
              .regions = std::move(regions),
              .instances = shared,
              .mucosa = Mucosa(file.mucosa, request.seed, std::move(tint), shared),
              .board = nullptr,
              .motion = std::move(motion.motion),
              .motion_reach_mm = motion.reach_mm,
              .seed = request.seed,
              .notes = std::move(wall.notes),
              .resolved_yaml = resolved_yaml(file)};
  scene.rest_positions = scene.wall.vertices;
  return scene;
}

}  // namespace rugae
