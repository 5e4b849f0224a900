#pragma once
// Depth maps become one surface: truncated signed distances (Curless and Levoy, SIGGRAPH 1996,
// doi:10.1145/237170.237269) on hashed blocks of voxels (Niessner et al., SIGGRAPH Asia 2013,
// doi:10.1145/2508363.2508374). Our own and not Open3D's, whose volumes count every pixel the same:
// here a depth counts by 1 / sigma^2, and distances are measured along the wall's normal, so that
// a wall seen obliquely is not taken for a thicker one.

#include <array>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <unordered_map>
#include <vector>

#include "core/mesh.h"
#include "recon/dense/depth_map.h"

namespace rugae {

/// |n . ray| of each pixel: n the unit normal of the wall that the depth shows, ray that of the
/// pixel with z = 1. CV_32F, NaN where the neighbours do not give a normal. Times a difference in
/// z-depth it is the distance from the wall; over the ray's length it is the cosine of incidence.
cv::Mat slant_of(const DepthMap& map);

class DistanceVolume {
 public:
  /// `voxel`: the side of a voxel, in the world's units.
  explicit DistanceVolume(double voxel);

  /// Adds a depth map with its colours (CV_32FC3, RGB, on its grid; NaN or empty: none). The wall
  /// seen more obliquely than 80 degrees is left out.
  void integrate(const DepthMap& map, const cv::Mat& colours);

  /// Surface nets (Gibson, MICCAI 1998, doi:10.1007/BFb0056277): a vertex a voxel that the wall
  /// passes through, at the mean of where it cuts the voxel's edges. Does not depend on the order
  /// in which blocks came to be. Geometric normals point away from the cameras; colours as
  /// integrated, 0 where there were none. Sigma as if all depth maps erred alike, the worst case
  /// and nearly the true one (they share frames, poses and windows): sum of w sigma over sum of w,
  /// with w = 1 / sigma^2.
  TriangleMesh extract() const;

 private:
  static constexpr int kSide = 8;  // voxels of a block, each way
  struct Voxel {
    float distance = 0.0f;  // from the wall, voxels; positive on the cameras' side
    float weight = 0.0f;    // sum of voxel^2 / sigma^2
    float roots = 0.0f;     // sum of voxel / sigma
    float colour_weight = 0.0f;
    std::array<float, 3> colour{};
  };
  using Block = std::array<Voxel, kSide * kSide * kSide>;
  struct View;

  /// Of a block, or of a voxel.
  static std::uint64_t key_of(const Vec3i& place);
  static Vec3i block_of(std::uint64_t key);
  std::vector<std::uint64_t> touched_blocks(const View& view) const;
  void update(const View& view, std::uint64_t key, Block& block) const;

  double voxel_;
  std::unordered_map<std::uint64_t, std::size_t> index_;
  std::vector<std::unique_ptr<Block>> blocks_;

  friend class SurfaceNets;
};

}  // namespace rugae
