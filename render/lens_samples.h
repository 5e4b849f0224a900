#pragma once
// The rays by which a pixel gathers light over its area, the aperture and the exposure.

#include <array>
#include <cstdint>
#include <vector>

#include "render/motion.h"
#include "render/tile.h"

namespace rugae {

struct LensSampling {
  int samples = 1;                  // a pixel
  double exposure_s = 0.0;          // 0: an instant
  double aperture_radius_mm = 0.0;  // 0: a pinhole
  double focus_distance_mm = 0.0;   // along the axis; with an aperture above 0
  std::uint64_t seed = 1;
  std::uint32_t frame = 0;
};

/// Sample k of n passes the pixel at (x_k, y_k), the aperture at (a_k, b_k) and is sent at t_k:
/// t_k = (k + u) / n of the exposure, one in each of n equal strata; the other four numbers are the
/// k-th point of Sobol's sequence (direction numbers of Joe and Kuo 2008, doi:10.1137/070709359)
/// under a random digital shift, so that n = 2^m samples lie one in each of n strata of every one
/// of them. Shifts are drawn for every pixel and frame. Times are taken in steps of a stratum's
/// 8th.
///
/// Thin lens: the ray leaves the aperture's point and meets the pixel's central ray where that
/// crosses the plane z = focus distance. A point at depth z then spreads over a circle of radius
/// fx A |1/z - 1/focus| px around its place (pinhole lens, aperture radius A).
class LensSampler {
 public:
  /// Keeps references. The ray's direction beside a pixel's centre is linear between the
  /// neighbours: it errs by less than 0.001 px for lenses as wide as 100 degrees.
  LensSampler(const RayTable& rays, const FrameView& view, const LensSampling& sampling);

  /// What the samples of a tile's pixels share.
  struct Pixels {
    Lanes<std::array<std::uint32_t, 4>> shift;  // digital
    Lanes<Vec3> to_right, down;                 // the ray's change over a pixel
  };
  /// Begins the tile whose first pixel is (x0, y0).
  void begin(int x0, int y0, Tile& tile, Pixels& pixels) const;
  /// Fills the rays of sample `k` for the tile that was begun.
  void place(int k, const Pixels& pixels, Tile& tile) const;

 private:
  const RayTable& rays_;
  LensSampling sampling_;
  int instants_a_row_;
  bool rows_alike_;
  std::vector<Instant> instants_;
};

}  // namespace rugae
