#pragma once
// A scene is a wall and what it is made of.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/float4.h"
#include "core/mesh.h"

namespace rugae {

/// Anatomical regions along the stomach; `unknown` for imported meshes without labels.
enum class Region : std::uint8_t {
  unknown,
  cardia,
  fundus,
  body,
  incisura,
  antrum,
  pylorus,
  oesophagus,
  duodenum
};
std::string region_name(Region region);

/// What light meets at one point of the wall. Linear RGB.
struct MucosaSample {
  Vec3f albedo = Vec3f::Constant(0.5f);  // Lambertian
  float roughness = 0.2f;                // GGX alpha of the wet layer
  float coverage = 1.0f;                 // share of the surface under the wet layer, 0 to 1
  float f0 = 0.02f;                      // Fresnel reflectance at normal incidence
  Vec3f coat_gradient =
      Vec3f::Zero();  // of the wet layer's height (dimensionless slope, in world axes); tilts its
                      // normal: n_coat = normalize(n - tangential part of the gradient)
  std::uint8_t instance = 0;  // id of the lesion or object there; 0: none
};

/// What the mucosa is asked about.
struct MucosaPlace {
  Vec3f rest_position_mm;
  Vec3f normal;  // of the wall, unit, of either side
  Region region = Region::unknown;
  float footprint_mm = 0.0f;  // width of a pixel on the wall
};

struct MucosaOptions {
  Vec3 base_albedo{0.62, 0.21, 0.1};  // linear RGB; replaced by the preset
  double vessel_contrast = 0.3;       // 0 to 1: how dark vessels are
  double mottle_contrast = 0.22;      // 0 to 1: blotches, areae and foveolae
  double wetness = 0.6;               // 0 to 1: share of the wall under the wet layer
  double oil = 0.0;  // 0 to 1: coverage and smoothness of an oil film (trajectory 6)
  void check(const std::string& where) const;
};

class Chessboard;
class Instances;
class RegionTint;

/// The mucosa as a pure function of the rest position, so that no UV map is needed and deformation
/// carries it along. Copies share their noise tiles; sampling is safe from many threads at once.
class Mucosa {
 public:
  /// Without a tint every region has the colour of the body (the oesophagus' pale one apart);
  /// without instances there are no lesions and objects.
  Mucosa(const MucosaOptions& options, std::uint64_t seed,
         std::shared_ptr<const RegionTint> tint = nullptr,
         std::shared_ptr<const Instances> instances = nullptr);
  /// Detail finer than twice a place's footprint is faded out, and the slopes that faded go into
  /// the roughness. Neighbours should be neighbours in the list.
  void sample(std::span<const MucosaPlace> places, std::span<MucosaSample> samples) const;
  MucosaSample sample(const Vec3f& rest_position_mm, const Vec3f& normal, Region region,
                      float footprint_mm) const;

 private:
  struct Tiles;
  struct FourPlaces;
  struct Layers;
  void find_layers(Layers& layers) const;
  Float4 vessels(const Layers& layers) const;
  void blend(const Layers& layers, std::span<MucosaSample> samples) const;
  MucosaOptions options_;
  Vec3f base_albedo_;
  std::shared_ptr<const Tiles> tiles_;
  std::shared_ptr<const RegionTint> tint_;
  std::shared_ptr<const Instances> instances_;  // null where there are none
};

/// Moves the wall: fills `vertices_mm` with where the wall's vertices are at `time_s` (seconds
/// since the first frame). A smooth function of time, the same at every call; safe from many
/// threads.
using WallMotion = std::function<void(double time_s, std::vector<Vec3>& vertices_mm)>;

struct Scene {
  std::string name;
  TriangleMesh wall;                 // at rest, with vertex normals
  std::vector<Vec3> rest_positions;  // of the vertices: where they are, relief and all, before any
                                     // deformation; what the mucosa is a function of
  std::vector<Region> regions;       // of the vertices
  std::shared_ptr<const Instances> instances;  // lesions and objects; null: none
  Mucosa mucosa;
  std::shared_ptr<const Chessboard> board =
      nullptr;                   // where the wall is one, its print in place of mucosa
  WallMotion motion;             // empty: the wall keeps still
  double motion_reach_mm = 0.0;  // no vertex is ever farther from its rest position
  std::uint64_t seed = 1;
  std::vector<std::string> notes;  // of an imported mesh: what was found and done, a line each
  std::string resolved_yaml;       // the scene's file with every default and every draw filled in

  /// Id of the lesion or object that holds a rest position, 0 for none: the rule of
  /// Instances::at, which the colours and the wall's shape follow too.
  int instance_at(const Vec3f& rest_position_mm) const;
};

/// A preset name, a YAML file, or any mesh file that assimp reads (units by `mm_per_unit` in YAML;
/// a bare mesh file must be in millimetres and is checked to be of the size of an organ). `seed`
/// draws relief and mucosa. `resolution` is "coarse", "medium" or "fine" (about 50k, 250k, 1M
/// triangles).
struct SceneRequest {
  std::string name_or_path = "stomach";
  std::uint64_t seed = 1;
  std::string resolution = "medium";
  double oil = 0.0;
};
Scene load_scene(const SceneRequest& request);

}  // namespace rugae
