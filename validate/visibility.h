#pragma once
// Which part of the wall the camera saw, from the true depth images.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "cameras/camera.h"
#include "cameras/row_poses.h"
#include "core/mesh.h"

namespace rugae {

struct VisibilityOptions {
  double max_incidence_rad = 1.2217304763960306;  // 70 degrees: flatter views show little
  // A centre counts as seen when its depth is at most that of the pixels around it, plus this.
  // Half a fold's thickness: what a fold hides lies deeper.
  double depth_margin_mm = 0.5;
  double depth_margin_share = 0.01;
  void check() const;
};

/// Counts, for every triangle of a wall, the frames in which its centre was seen. A triangle is
/// judged by its centre alone, so the wall should be finer than what is asked of it.
class Visibility {
 public:
  Visibility(const TriangleMesh& wall, const VisibilityOptions& options);  // keeps a reference

  /// A frame of the wall at rest. `depth_mm` is z-depth, CV_32F, of the lens' size, NaN where
  /// nothing was hit; of a rolling shutter each row's along its own optical axis.
  void add(const Lens& lens, const RowPoses& camera, const cv::Mat& depth_mm);
  /// A frame of the wall where it has moved to: of the same triangles, its vertices elsewhere.
  void add(const Lens& lens, const RowPoses& camera, const cv::Mat& depth_mm,
           const TriangleMesh& moved);

  /// Frames that saw each triangle; and saw it below the incidence of the options.
  const std::vector<std::uint32_t>& seen() const { return seen_; }
  const std::vector<std::uint32_t>& seen_well() const { return seen_well_; }

  double wall_area_mm2() const;
  /// Area seen in at least `times` frames below the incidence of the options.
  double covered_area_mm2(std::uint32_t times) const;
  /// The triangles seen at least once at any incidence; all vertices are kept. Of a wall that
  /// moves, where it was while it was seen: each vertex at its mean place over the frames that saw
  /// a triangle of it.
  TriangleMesh seen_wall() const;

 private:
  struct Patch {
    Vec3 centre, normal;
  };
  static Patch patch_of(const TriangleMesh& wall, std::size_t t);
  template <typename PatchAt, typename See>
  void look(const Lens& lens, const RowPoses& camera, const cv::Mat& depth_mm, PatchAt patch_at,
            See see);

  const TriangleMesh& wall_;
  VisibilityOptions options_;
  std::vector<Patch> at_rest_;  // of each triangle
  std::vector<std::uint32_t> seen_, seen_well_;
  // Of a wall that moves, else empty: of each vertex how many frames saw it, and how far from its
  // place at rest, added up.
  std::vector<std::uint32_t> times_;
  std::vector<Vec3> displacement_mm_;
};

}  // namespace rugae
