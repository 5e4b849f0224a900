#pragma once
// The wall at the hits of a tile: interpolated normals, and the mucosa's material.

#include <functional>
#include <span>
#include <vector>

#include "render/tile.h"
#include "scenes/scene.h"

namespace rugae {

/// What a material is asked about; the normal is that of the shading, by the mesh's winding.
using MaterialQuery = MucosaPlace;
/// Fills one sample a query; called once a tile, from many threads.
using Material = std::function<void(std::span<const MaterialQuery>, std::span<MucosaSample>)>;

/// The material at a pixel's own point, for rays that meet the wall beside it. It is filtered over
/// the pixel's footprint, so it is that of every place within it.
struct PixelMaterial {
  Vec3f rest_position_mm;
  MucosaSample material;
  bool known = false;
};

/// The wall at the lanes of a tile that met it.
struct SurfaceTile {
  int count = 0;
  Lanes<int> lane;              // of the tile
  Lanes<Vec3f> shading_normal;  // world axes, facing the camera's side
  Lanes<MaterialQuery> query;
  Lanes<MucosaSample> material;

  // Of the lanes whose material is not known yet.
  Lanes<int> asked;
  Lanes<MaterialQuery> asked_query;
  Lanes<MucosaSample> answer;
};

class Surface {
 public:
  /// Keeps references: the scene must outlive it. The material is the scene's mucosa, or
  /// the print of its board.
  explicit Surface(const Scene& scene);
  /// A wall of any material; rest positions are the vertices.
  Surface(const TriangleMesh& wall, Material material);
  /// The wall of `rest` elsewhere: `moved` has the same triangles, and vertex normals.
  Surface(const Surface& rest, const TriangleMesh& moved);

  const TriangleMesh& wall() const { return *wall_; }
  /// Unit geometric normal by the winding, world axes; zero for a triangle without area.
  Vec3f geometric_normal(int triangle) const { return triangle_normals_[triangle].head<3>(); }
  /// Works out every lane that met the wall. Where it was met within a footprint of the point that
  /// `known` has for the pixel, that material is taken; `known` is empty or has one entry a pixel.
  void look_up(const Tile& tile, const RayTable& rays, SurfaceTile& surface,
               std::span<const PixelMaterial> known = {}) const;
  /// The same for rays that stand for cones of `spread_rad` (square root of the solid angle), by
  /// lane.
  void look_up(const Tile& tile, const Lanes<float>& spread_rad, SurfaceTile& surface) const;

 private:
  // Two registers, half a cache line.
  struct alignas(32) Vertex {
    Vec3f normal;
    Region region;
    Vec3f rest_position_mm;
    float unused = 0.0f;
  };
  void find_triangle_normals();
  // All of a SurfaceTile but the materials.
  void look_up_shape(const Tile& tile, const Lanes<float>& spread_rad, SurfaceTile& surface) const;
  void look_up_four(const Tile& tile, const Lanes<float>& spread_rad, int k,
                    SurfaceTile& surface) const;
  void pack(const std::vector<Vec3>& rest_positions, const std::vector<Region>& regions);

  const TriangleMesh* wall_;
  Material material_;
  std::vector<Vertex> vertices_;
  std::vector<Eigen::Vector4f> triangle_normals_;  // and 0: a register each
};

}  // namespace rugae
