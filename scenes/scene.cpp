#include "scenes/scene.h"

#include <algorithm>
#include <cctype>

#include "core/check.h"
#include "core/presets.h"
#include "core/yaml.h"
#include "scenes/deformation.h"
#include "scenes/import.h"
#include "scenes/instances.h"
#include "scenes/long_axis.h"
#include "scenes/region_tint.h"
#include "scenes/stomach.h"

namespace rugae {
namespace {

// Grid cells that give about 50k, 250k and 1M triangles: 3 A / cell^2 for the smooth wall's area of
// about 73,000 mm^2 (scale 1).
constexpr double kCellMm[] = {2.12, 0.96, 0.475};
const std::vector<std::string> kResolutions = {"coarse", "medium", "fine"};

enum class Kind { procedural, mesh };

struct SceneFile {
  Kind kind = Kind::procedural;
  StomachOptions stomach;
  ImportOptions import;
  std::filesystem::path mesh;
  MucosaOptions mucosa;
  DeformationOptions deformation;
};

void read_relief(YamlReader yaml, ReliefOptions& relief, const std::string& where) {
  yaml.get("rugae_height_mm", relief.rugae_height_mm);
  yaml.get("rugae_thickness_mm", relief.rugae_thickness_mm);
  yaml.get("rugae_spacing_mm", relief.rugae_spacing_mm);
  yaml.get("areae_size_mm", relief.areae_size_mm);
  yaml.get("areae_depth_mm", relief.areae_depth_mm);
  yaml.finish();
  relief.check(where);
}

void read_mucosa(YamlReader yaml, MucosaOptions& mucosa, const std::string& where) {
  yaml.get("base_albedo", mucosa.base_albedo);
  yaml.get("vessel_contrast", mucosa.vessel_contrast);
  yaml.get("mottle_contrast", mucosa.mottle_contrast);
  yaml.get("wetness", mucosa.wetness);
  yaml.get("oil", mucosa.oil);
  yaml.finish();
  mucosa.check(where);
}

void read_lesions(YamlReader yaml, InstanceOptions& instances) {
  yaml.get("polyp", instances.polyp);
  yaml.get("ulcer", instances.ulcer);
  yaml.get("erosion", instances.erosion);
  yaml.get("bleeding", instances.bleeding);
  yaml.get("angiectasia", instances.angiectasia);
  yaml.finish();
}

void read_objects(YamlReader yaml, InstanceOptions& instances) {
  yaml.get("debris", instances.debris);
  yaml.get("bubbles", instances.bubbles);
  yaml.get("mucus", instances.mucus);
  yaml.finish();
}

void read_import(YamlReader& yaml, SceneFile& scene, const std::filesystem::path& file) {
  std::string mesh;
  yaml.require("mesh", mesh);
  scene.mesh = file.parent_path() / mesh;  // an absolute path stays itself
  yaml.get("mm_per_unit", scene.import.mm_per_unit);
  int wall = 0, ends = 0;
  yaml.get_choice("wall_normals", {"auto", "outward", "inward"}, wall);
  scene.import.wall = static_cast<WallNormals>(wall);
  yaml.get_choice("open_ends", {"cap", "refuse"}, ends);
  scene.import.open_ends = static_cast<OpenEnds>(ends);
  yaml.get("component", scene.import.component);
  yaml.get("target_edge_mm", scene.import.target_edge_mm);
  yaml.get("with_relief", scene.import.with_relief);
  scene.import.check(file.string());
}

SceneFile read_scene_file(const std::filesystem::path& file) {
  YamlReader yaml = YamlReader::from_file(file);
  SceneFile scene;
  int kind = 0;
  yaml.get_choice("kind", {"procedural", "mesh"}, kind);
  scene.kind = static_cast<Kind>(kind);
  if (scene.kind == Kind::mesh)
    read_import(yaml, scene, file);
  else
    yaml.get("scale", scene.stomach.scale);
  if (auto relief = yaml.child("relief")) {
    ReliefOptions options;
    read_relief(*relief, options, file.string() + ": relief");
    scene.stomach.relief = scene.import.relief = options;
  }
  if (auto mucosa = yaml.child("mucosa"))
    read_mucosa(*mucosa, scene.mucosa, file.string() + ": mucosa");
  if (auto deformation = yaml.child("deformation")) {
    read_deformation(*deformation, scene.deformation);
    scene.deformation.check(file.string() + ": deformation");
  }
  for (const char* key : {"lesions", "objects"})
    check(scene.kind == Kind::procedural || !yaml.has(key),
          "{}: {} need a stomach of kind procedural", yaml.where(key), key);
  if (auto lesions = yaml.child("lesions")) read_lesions(*lesions, scene.stomach.instances);
  if (auto objects = yaml.child("objects")) read_objects(*objects, scene.stomach.instances);
  yaml.finish();
  scene.stomach.check(file.string());
  return scene;
}

// Along a stomach's own axis, or along the wall's longest way with a stomach's proportions.
OrganMotion find_motion(const SceneFile& file, const TriangleMesh& wall) {
  const DeformationOptions& options = file.deformation;
  if (!options.peristalsis && !options.breathing) return {};
  if (file.kind == Kind::procedural) {
    const StomachShape shape(file.stomach.scale);
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
    file.kind = Kind::mesh;
    file.mesh = request.name_or_path;
  } else {
    file = read_scene_file(find_preset("scenes", "scene", request.name_or_path));
  }
  file.mucosa.oil = std::max(file.mucosa.oil, request.oil);
  ImportedWall wall;
  std::vector<Region> regions;
  std::shared_ptr<const RegionTint> tint;
  std::vector<WallInstance> instances;
  if (file.kind == Kind::mesh) {
    wall = import_wall(file.mesh, file.import, request.seed, level);
    regions.assign(wall.mesh.vertices.size(), Region::unknown);
  } else {
    StomachWall stomach =
        make_stomach(file.stomach, request.seed, kCellMm[level] * file.stomach.scale);
    wall.mesh = std::move(stomach.mesh);
    regions = std::move(stomach.regions);
    instances = std::move(stomach.instances);
    const StomachShape shape(file.stomach.scale);
    tint = std::make_shared<RegionTint>(
        shape.box(), [&](const Vec3& p) { return shape.region(p, shape.locate(p)); });
  }
  const auto shared = std::make_shared<const Instances>(std::move(instances));
  OrganMotion motion = find_motion(file, wall.mesh);
  Scene scene{.name = std::filesystem::path(request.name_or_path).stem().string(),
              .wall = std::move(wall.mesh),
              .rest_positions = {},
              .regions = std::move(regions),
              .instances = shared,
              .mucosa = Mucosa(file.mucosa, request.seed, std::move(tint), shared),
              .motion = std::move(motion.motion),
              .motion_reach_mm = motion.reach_mm,
              .seed = request.seed,
              .notes = std::move(wall.notes)};
  scene.rest_positions = scene.wall.vertices;
  return scene;
}

}  // namespace rugae
