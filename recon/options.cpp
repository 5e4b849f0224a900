#include "recon/options.h"

#include <string>
#include <utility>
#include <vector>

#include "core/fields.h"

namespace rugae {
namespace {

const std::vector<std::string> kInpaintings = {"telea", "navier_stokes"};

}  // namespace

template <typename Visitor>
void fields(Visitor& v, ReflectionOptions& o) {
  v.flag("suppress_for_pose", o.suppress_for_pose);
  v.flag("suppress_for_map", o.suppress_for_map);
  v.choice("inpainting", o.inpainting, kInpaintings);
  v.number("closing_px", o.closing_px, 1, 101);
  v.number("inpaint_radius_px", o.inpaint_radius_px, 1.0, 50.0);
}

template <typename Visitor>
void fields(Visitor& v, PreprocessOptions& o) {
  v.section("reflections", o.reflections);
  v.flag("undistort", o.undistort);
  v.flag("devignette", o.devignette);
}

template <typename Visitor>
void fields(Visitor& v, KeyframeOptions& o) {
  v.number("mean_flow_px", o.mean_flow_px, 0.1, 1000.0);
  v.number("max_gap", o.max_gap, 1, 10000);
}

template <typename Visitor>
void fields(Visitor& v, AlignOptions& o) {
  v.number("grid_px", o.grid_px, 2, 64);
  v.number("ransac_threshold_px", o.ransac_threshold_px, 0.1, 100.0);
  v.number("patch_radius_px", o.patch_radius_px, 2, 100);
  v.number("stop_mse", o.stop_mse, 0.0, 1.0);
  v.number("max_iterations", o.max_iterations, 1, 10000);
  v.number("min_inliers", o.min_inliers, 4, 1000000);
  v.number("neighbours", o.neighbours, 1, 100);
}

template <typename Visitor>
void fields(Visitor& v, TrackOptions& o) {
  v.number("spacing_px", o.spacing_px, 2.0, 200.0);
}

template <typename Visitor>
void fields(Visitor& v, BundleOptions& o) {
  v.number("huber_px", o.huber_px, 1e-3, 1000.0);
  v.angle("min_parallax", o.min_parallax_rad, 0.0, 0.5 * kPi);
  v.number("max_iterations", o.max_iterations, 1, 10000);
  v.number("min_resection_inliers", o.min_resection_inliers, 4, 1000000);
}

template <typename Visitor>
void fields(Visitor& v, MosaicOptions& o) {
  v.angle("max_view_angle", o.max_view_angle_rad, 0.0, 0.5 * kPi);
  v.number("bands", o.bands, 1, 16);
}

template <typename Visitor>
void fields(Visitor& v, ShadingOptions& o) {
  v.number("iterations", o.iterations, 1, 10000);
  v.number("w_n", o.w_n, 1e-12, 1.0);  // 0: the gain of a settled pixel is 0 / 0
  v.number("s_0", o.s_0, 0.0, 1000.0);
}

template <typename Visitor>
void fields(Visitor& v, MapOptions& o) {
  v.number("voxel_share", o.voxel_share, 1.0 / 4096.0, 0.5);
}

template <typename Visitor>
void fields(Visitor& v, RevisitOptions& o) {
  v.number("neighbours", o.neighbours, 1, 100);
  v.number("rounds", o.rounds, 0, 100);
  v.number("search_px", o.search_px, 0.0, 1000.0);
}

template <typename Visitor>
void fields(Visitor& v, DenseOptions& o) {
  v.number("width_px", o.width_px, 32, 4096);
  v.number("max_depth_maps", o.max_depth_maps, 1, 10000);
  v.number("depth_maps_a_point", o.depth_maps_a_point, 1, 100);
  v.number("views", o.views, 2, 32);
  v.number("window_radius_px", o.window_radius_px, 1, 20);
  v.number("min_score", o.min_score, 0.0, 1.0);
  v.number("max_sigma_share", o.max_sigma_share, 1e-6, 1.0);
  v.number("consistent_maps", o.consistent_maps, 0, kComparedMaps);
  v.number("consistent_sigmas", o.consistent_sigmas, 0.1, 100.0);
  v.number("gap_sigma_share", o.gap_sigma_share, 0.0, 1.0);
  v.number("voxel_px", o.voxel_px, 0.5, 100.0);
}

template <typename Visitor>
void fields(Visitor& v, ReconOptions& o) {
  v.word("method", o.method, kMethods);
  v.section("preprocess", o.preprocess);
  v.section("keyframes", o.keyframes);
  v.section("align", o.align);
  v.section("tracks", o.tracks);
  v.section("bundle", o.bundle);
  v.section("mosaic", o.mosaic);
  v.section("shading", o.shading);
  v.section("map", o.map);
  v.section("revisits", o.revisits);
  v.section("dense", o.dense);
  v.flag("pictures", o.pictures);
  v.seed("seed", o.seed);
}

void ReflectionOptions::check() const { check_fields(*this, "reflections"); }
void PreprocessOptions::check() const { check_fields(*this, "preprocess"); }
void KeyframeOptions::check() const { check_fields(*this, "keyframes"); }
void AlignOptions::check() const { check_fields(*this, "align"); }
void TrackOptions::check() const { check_fields(*this, "tracks"); }
void BundleOptions::check() const { check_fields(*this, "bundle"); }
void MosaicOptions::check() const { check_fields(*this, "mosaic"); }
void ShadingOptions::check() const { check_fields(*this, "shading"); }
void MapOptions::check() const { check_fields(*this, "map"); }
void RevisitOptions::check() const { check_fields(*this, "revisits"); }
void DenseOptions::check() const { check_fields(*this, "dense"); }
void ReconOptions::check() const { check_fields(*this, "recon"); }

void read_options(YamlReader yaml, ReconOptions& options) { read_fields(std::move(yaml), options); }

std::string to_json_text(const ReconOptions& options) { return json_of_fields(options).dump(); }

}  // namespace rugae
