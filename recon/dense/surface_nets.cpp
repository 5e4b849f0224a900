// The surface in a volume of distances.

#include <algorithm>
#include <cmath>

#include "recon/dense/volume.h"

namespace rugae {

/// Walks over the cells of a volume; a cell is the cube between eight voxels, named by the first.
class SurfaceNets {
 public:
  explicit SurfaceNets(const DistanceVolume& volume) : volume_(volume) {
    for (const auto& [key, place] : volume.index_) keys_.push_back(key);
    std::ranges::sort(keys_);
  }

  TriangleMesh surface() {
    // Cells begin at a voxel of a block that exists; vertices first, then the faces between them.
    for (const std::uint64_t key : keys_) for_voxels(key, [&](const Vec3i& v) { add_vertex(v); });
    for (const std::uint64_t key : keys_) for_voxels(key, [&](const Vec3i& v) { add_faces(v); });
    return std::move(surface_);
  }

 private:
  static constexpr int kSide = DistanceVolume::kSide;
  using Voxel = DistanceVolume::Voxel;

  template <typename Visit>
  static void for_voxels(std::uint64_t key, const Visit& visit) {
    const Vec3i origin = kSide * DistanceVolume::block_of(key);
    for (int z = 0; z < kSide; ++z)
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) visit(origin + Vec3i(x, y, z));
  }

  static Vec3i block_at(const Vec3i& v) {
    return {v.x() >> kShift, v.y() >> kShift, v.z() >> kShift};
  }
  static std::size_t within(const Vec3i& v) {
    constexpr int kMask = kSide - 1;
    return static_cast<std::size_t>(((v.z() & kMask) * kSide + (v.y() & kMask)) * kSide +
                                    (v.x() & kMask));
  }

  /// The voxel, or nothing where no depth map has told its distance.
  const Voxel* at(const Vec3i& v) {
    const std::uint64_t key = DistanceVolume::key_of(block_at(v));
    if (key != last_key_) {
      const auto found = volume_.index_.find(key);
      last_key_ = key;
      last_ = found == volume_.index_.end() ? nullptr : volume_.blocks_[found->second].get();
    }
    if (last_ == nullptr) return nullptr;
    const Voxel* voxel = &(*last_)[within(v)];
    return voxel->weight > 0.0f ? voxel : nullptr;
  }

  void add_vertex(const Vec3i& cell) {
    std::array<const Voxel*, 8> corners;
    int inside = 0;
    for (int c = 0; c < 8; ++c) {
      corners[c] = at(cell + corner(c));
      if (corners[c] == nullptr) return;
      inside += corners[c]->distance > 0.0f ? 1 : 0;
    }
    if (inside == 0 || inside == 8) return;
    Vec3 place = Vec3::Zero();
    Vec3f colour = Vec3f::Zero();
    float weight = 0.0f, roots = 0.0f, colour_weight = 0.0f;
    int cuts = 0;
    for (int a = 0; a < 8; ++a)
      for (int axis = 0; axis < 3; ++axis) {
        const int b = a | 1 << axis;
        if (b == a) continue;
        const float da = corners[a]->distance, db = corners[b]->distance;
        if ((da > 0.0f) == (db > 0.0f)) continue;
        const float t = da / (da - db);
        place += corner(a).cast<double>() +
                 static_cast<double>(t) * (corner(b) - corner(a)).cast<double>();
        weight += (1.0f - t) * corners[a]->weight + t * corners[b]->weight;
        roots += (1.0f - t) * corners[a]->roots + t * corners[b]->roots;
        for (const auto& [voxel, share] : {std::pair(corners[a], 1.0f - t), {corners[b], t}}) {
          const float w = share * voxel->colour_weight;
          colour += w * Vec3f(voxel->colour[0], voxel->colour[1], voxel->colour[2]);
          colour_weight += w;
        }
        ++cuts;
      }
    vertex_of_[cell_key(cell)] = static_cast<int>(surface_.vertices.size());
    surface_.vertices.push_back(volume_.voxel_ * (cell.cast<double>() + place / cuts));
    surface_.colors.push_back(colour_weight > 0.0f ? Vec3f(colour / colour_weight) : Vec3f::Zero());
    surface_.sigma.push_back(static_cast<float>(volume_.voxel_) * roots / weight);
  }

  /// The faces around the three edges that begin at this voxel.
  void add_faces(const Vec3i& v) {
    const Voxel* here = at(v);
    if (here == nullptr) return;
    for (int axis = 0; axis < 3; ++axis) {
      const Voxel* there = at(v + Vec3i::Unit(axis));
      if (there == nullptr || (here->distance > 0.0f) == (there->distance > 0.0f)) continue;
      // The four cells around the edge, turning from the next axis to the one after it.
      const Vec3i e1 = Vec3i::Unit((axis + 1) % 3), e2 = Vec3i::Unit((axis + 2) % 3);
      const std::array<int, 4> corner_vertices = {vertex(v - e1 - e2), vertex(v - e2), vertex(v),
                                                  vertex(v - e1)};
      if (*std::ranges::min_element(corner_vertices) < 0) continue;
      // Their winding looks along the axis: outward when the cameras' side comes first.
      auto [a, b, c, d] = corner_vertices;
      if (!(here->distance > 0.0f)) std::swap(b, d);
      const auto& p = surface_.vertices;
      // Cut along the shorter diagonal.
      if ((p[a] - p[c]).squaredNorm() <= (p[b] - p[d]).squaredNorm()) {
        surface_.triangles.emplace_back(a, b, c);
        surface_.triangles.emplace_back(a, c, d);
      } else {
        surface_.triangles.emplace_back(a, b, d);
        surface_.triangles.emplace_back(b, c, d);
      }
    }
  }

  int vertex(const Vec3i& cell) const {
    const auto found = vertex_of_.find(cell_key(cell));
    return found == vertex_of_.end() ? -1 : found->second;
  }

  static Vec3i corner(int c) { return {c & 1, c >> 1 & 1, c >> 2 & 1}; }
  static std::uint64_t cell_key(const Vec3i& cell) { return DistanceVolume::key_of(cell); }

  static constexpr int kShift = 3;
  static_assert(1 << kShift == kSide);
  const DistanceVolume& volume_;
  std::vector<std::uint64_t> keys_;
  std::uint64_t last_key_ = ~std::uint64_t{0};
  const DistanceVolume::Block* last_ = nullptr;
  std::unordered_map<std::uint64_t, int> vertex_of_;
  TriangleMesh surface_;
};

TriangleMesh DistanceVolume::extract() const { return SurfaceNets(*this).surface(); }

}  // namespace rugae
