#include "render/surface.h"

#include <algorithm>
#include <cmath>

namespace rugae {
namespace {

// A pixel's footprint on a wall seen at grazing incidence is long and narrow; its geometric mean
// grows with 1 / sqrt(cos), up to this cosine.
constexpr float kLeastCosine = 0.1f;

}  // namespace

Surface::Surface(const Scene& scene)
    : wall_(&scene.wall),
      material_([mucosa = &scene.mucosa](std::span<const MaterialQuery> queries,
                                         std::span<MucosaSample> samples) {
        mucosa->sample(queries, samples);
      }) {
  pack(scene.rest_positions, scene.regions);
}

Surface::Surface(const TriangleMesh& wall, Material material)
    : wall_(&wall), material_(std::move(material)) {
  pack(wall.vertices, {});
}

Surface::Surface(const Surface& rest, const TriangleMesh& moved)
    : wall_(&moved), material_(rest.material_), vertices_(rest.vertices_) {
  for (std::size_t i = 0; i < vertices_.size(); ++i) vertices_[i].normal = moved.normals[i];
  find_triangle_normals();
}

void Surface::pack(const std::vector<Vec3>& rest_positions, const std::vector<Region>& regions) {
  const std::vector<Vec3f> normals =
      wall_->normals.empty() ? angle_weighted_normals(*wall_) : wall_->normals;
  vertices_.resize(wall_->vertices.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    vertices_[i] = {normals[i],
                    (rest_positions.empty() ? wall_->vertices[i] : rest_positions[i]).cast<float>(),
                    regions.empty() ? Region::unknown : regions[i]};
  find_triangle_normals();
}

void Surface::find_triangle_normals() {
  triangle_normals_.resize(wall_->triangles.size());
  for (std::size_t t = 0; t < triangle_normals_.size(); ++t)
    triangle_normals_[t] = triangle_normal(*wall_, t).cast<float>();
}

void Surface::look_up(const Tile& tile, const RayTable& rays, SurfaceTile& surface,
                      std::span<const PixelMaterial> known) const {
  Lanes<float> spread_rad;
  for (int lane = 0; lane < tile.count; ++lane)
    spread_rad[lane] = rays.pixel_angle_rad[tile.pixel[lane]];
  if (known.empty()) return look_up(tile, spread_rad, surface);
  look_up_shape(tile, spread_rad, surface);
  std::size_t asked = 0;
  for (int k = 0; k < surface.count; ++k) {
    const MaterialQuery& query = surface.query[k];
    const PixelMaterial& pixel = known[static_cast<std::size_t>(tile.pixel[surface.lane[k]])];
    const float apart2 = (query.rest_position_mm - pixel.rest_position_mm).squaredNorm();
    if (pixel.known && apart2 <= query.footprint_mm * query.footprint_mm) {
      surface.material[k] = pixel.material;
    } else {
      surface.asked[asked] = k;
      surface.asked_query[asked++] = query;
    }
  }
  if (asked == 0) return;
  material_({surface.asked_query.data(), asked}, {surface.answer.data(), asked});
  for (std::size_t i = 0; i < asked; ++i) surface.material[surface.asked[i]] = surface.answer[i];
}

void Surface::look_up(const Tile& tile, const Lanes<float>& spread_rad,
                      SurfaceTile& surface) const {
  look_up_shape(tile, spread_rad, surface);
  const auto n = static_cast<std::size_t>(surface.count);
  if (n > 0) material_({surface.query.data(), n}, {surface.material.data(), n});
}

void Surface::look_up_shape(const Tile& tile, const Lanes<float>& spread_rad,
                            SurfaceTile& surface) const {
  surface.count = 0;
  for (int lane = 0; lane < tile.count; ++lane) {
    const Hit& hit = tile.hit[lane];
    if (!hit.met()) continue;
    const int k = surface.count++;
    surface.lane[k] = lane;
    const Vec3i& corners = wall_->triangles[hit.triangle];
    const Vertex &a = vertices_[corners[0]], &b = vertices_[corners[1]], &c = vertices_[corners[2]];
    const float b0 = 1.0f - hit.b1 - hit.b2;

    Vec3f normal = b0 * a.normal + hit.b1 * b.normal + hit.b2 * c.normal;
    const float length2 = normal.squaredNorm();
    const Vec3f& geometric = triangle_normals_[hit.triangle];
    normal = length2 > 0.0f ? Vec3f(normal / std::sqrt(length2)) : geometric;
    const Vec3f direction = tile.direction_world[lane].cast<float>();
    // The side is decided by the triangle: the interpolated normal may bend past the horizon.
    surface.shading_normal[k] = geometric.dot(direction) > 0.0f ? Vec3f(-normal) : normal;

    MaterialQuery& query = surface.query[k];
    query.rest_position_mm =
        b0 * a.rest_position_mm + hit.b1 * b.rest_position_mm + hit.b2 * c.rest_position_mm;
    query.normal = normal;
    query.region = b0 >= hit.b1 && b0 >= hit.b2 ? a.region : (hit.b1 >= hit.b2 ? b : c).region;
    const float cosine = std::max(kLeastCosine, std::abs(normal.dot(direction)));
    query.footprint_mm = static_cast<float>(hit.range_mm) * spread_rad[lane] / std::sqrt(cosine);
  }
}

}  // namespace rugae
