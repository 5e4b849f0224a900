#pragma once
// Options of the dense map.

namespace rugae {

struct DenseOptions {
  int width_px = 400;              // of a depth map, at most; it shows all that the lens sees
  int max_depth_maps = 100;        // key frames that get one; bounds time and memory
  int depth_maps_a_point = 4;      // wanted: each sparse point in so many of them
  int views = 8;                   // other key frames each is compared with
  int window_radius_px = 4;        // of the correlation, in the depth map's pixels
  double min_score = 0.45;         // correlation of a depth that is believed
  double max_sigma_share = 0.05;   // standard deviation of a depth that is believed, over the depth
  int consistent_maps = 2;         // other depth maps that must agree
  double consistent_sigmas = 3.0;  // within so many joint standard deviations
  double voxel_px = 4.0;           // side of a voxel, in the wall's width of a depth map's pixel
  void check() const;
};

/// For core/fields.h.
template <typename Visitor>
void fields(Visitor& v, DenseOptions& o) {
  v.number("width_px", o.width_px, 32, 4096);
  v.number("max_depth_maps", o.max_depth_maps, 1, 10000);
  v.number("depth_maps_a_point", o.depth_maps_a_point, 1, 100);
  v.number("views", o.views, 2, 32);
  v.number("window_radius_px", o.window_radius_px, 1, 20);
  v.number("min_score", o.min_score, 0.0, 1.0);
  v.number("max_sigma_share", o.max_sigma_share, 1e-6, 1.0);
  v.number("consistent_maps", o.consistent_maps, 0, 100);
  v.number("consistent_sigmas", o.consistent_sigmas, 0.1, 100.0);
  v.number("voxel_px", o.voxel_px, 0.5, 100.0);
}

}  // namespace rugae
