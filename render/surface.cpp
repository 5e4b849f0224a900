#include "render/surface.h"

#include <algorithm>
#include <cmath>

#include "core/float4.h"
#include "scenes/chessboard.h"

namespace rugae {
namespace {

// A pixel's footprint on a wall seen at grazing incidence is long and narrow; its geometric mean
// grows with 1 / sqrt(cos), up to this cosine.
constexpr float kLeastCosine = 0.1f;
constexpr int kFour = 4;  // lanes at once

}  // namespace

Surface::Surface(const Scene& scene) : wall_(&scene.wall) {
  // What is asked is asked so often that the choice is made once.
  if (scene.board)
    material_ = [board = scene.board](std::span<const MaterialQuery> queries,
                                      std::span<MucosaSample> samples) {
      board->sample(queries, samples);
    };
  else
    material_ = [mucosa = &scene.mucosa](std::span<const MaterialQuery> queries,
                                         std::span<MucosaSample> samples) {
      mucosa->sample(queries, samples);
    };
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
    vertices_[i] = {
        normals[i], regions.empty() ? Region::unknown : regions[i],
        (rest_positions.empty() ? wall_->vertices[i] : rest_positions[i]).cast<float>()};
  find_triangle_normals();
}

void Surface::find_triangle_normals() {
  triangle_normals_.resize(wall_->triangles.size());
  for (std::size_t t = 0; t < triangle_normals_.size(); ++t)
    triangle_normals_[t] << triangle_normal(*wall_, t).cast<float>(), 0.0f;
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
  for (int lane = 0; lane < tile.count; ++lane)
    if (tile.hit[lane].met()) surface.lane[surface.count++] = lane;
  for (int k = 0; k < surface.count; k += kFour) look_up_four(tile, spread_rad, k, surface);
}

// The last lane again where there are fewer than four.
void Surface::look_up_four(const Tile& tile, const Lanes<float>& spread_rad, int k,
                           SurfaceTile& surface) const {
  struct One {
    Float4 normal, rest_mm, facet, direction;  // x, y, z and anything
    Region region;
    float width_mm;  // of the pixel's cone, across it
  };
  const auto look_up_one = [&](int i) {
    const int lane = surface.lane[std::min(k + i, surface.count - 1)];
    const Hit& hit = tile.hit[lane];
    const Vec3i& corners = wall_->triangles[hit.triangle];
    const Vertex &a = vertices_[corners[0]], &b = vertices_[corners[1]], &c = vertices_[corners[2]];
    const float b0 = 1.0f - hit.b1 - hit.b2;
    const auto blend = [&](Vec3f Vertex::*value) {
      return splat(b0) * _mm_load_ps((a.*value).data()) +
             splat(hit.b1) * _mm_load_ps((b.*value).data()) +
             splat(hit.b2) * _mm_load_ps((c.*value).data());
    };
    const double* const direction = tile.direction_world[lane].data();
    return One{blend(&Vertex::normal),
               blend(&Vertex::rest_position_mm),
               _mm_load_ps(triangle_normals_[hit.triangle].data()),
               _mm_movelh_ps(_mm_cvtpd_ps(_mm_loadu_pd(direction)),
                             _mm_cvtpd_ps(_mm_load_sd(direction + 2))),
               b0 >= hit.b1 && b0 >= hit.b2 ? a.region : (hit.b1 >= hit.b2 ? b : c).region,
               static_cast<float>(hit.range_mm) * spread_rad[lane]};
  };
  const One one[kFour] = {look_up_one(0), look_up_one(1), look_up_one(2), look_up_one(3)};
  const auto four = [&one](Float4 One::*value) {
    return first3(transposed(one[0].*value, one[1].*value, one[2].*value, one[3].*value));
  };
  const Float4x3 sum = four(&One::normal), rest_mm = four(&One::rest_mm), facet = four(&One::facet),
                 direction = four(&One::direction);
  const Float4 length2 = dot(sum, sum), length = root(length2), zero = _mm_setzero_ps();
  const Float4x3 normal =
      select(above(length2, zero), {sum.x / length, sum.y / length, sum.z / length}, facet);
  // The side is decided by the triangle: the interpolated normal may bend past the horizon.
  const Float4 from_behind = above(dot(facet, direction), zero);
  const Float4x3 shading = select(from_behind, normal * -1.0f, normal);
  const Float4 across = dot(normal, direction);
  const Float4 cosine = max(splat(kLeastCosine), max(across, zero - across));
  const Float4 width_mm =
      _mm_setr_ps(one[0].width_mm, one[1].width_mm, one[2].width_mm, one[3].width_mm);
  const auto region = [&one](int i) { return static_cast<int>(one[i].region); };

  const auto stored = [k, count = std::min(kFour, surface.count - k)](const Float4x4& values,
                                                                      const auto& put) {
    const Float4x4 each = transposed(values.x, values.y, values.z, values.w);
    const Float4 v[kFour] = {each.x, each.y, each.z, each.w};
    for (int i = 0; i < count; ++i) put(k + i, v[i]);
  };
  // A query as Mucosa reads it: two registers.
  stored({rest_mm.x, rest_mm.y, rest_mm.z, normal.x},
         [&](int to, Float4 v) { _mm_storeu_ps(surface.query[to].rest_position_mm.data(), v); });
  stored(
      {normal.y, normal.z,
       _mm_castsi128_ps(_mm_setr_epi32(region(0), region(1), region(2), region(3))),
       width_mm / root(cosine)},
      [&](int to, Float4 v) { _mm_storeu_ps(surface.query[to].rest_position_mm.data() + 4, v); });
  stored({shading.x, shading.y, shading.z, zero}, [&](int to, Float4 v) {
    _mm_storel_pi(reinterpret_cast<__m64*>(surface.shading_normal[to].data()), v);
    _mm_store_ss(surface.shading_normal[to].data() + 2, _mm_movehl_ps(v, v));
  });
}

}  // namespace rugae
