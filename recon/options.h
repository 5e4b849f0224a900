#pragma once
// Every option of the reconstruction, one small struct a stage; YAML maps onto them one to one
// (recon: of a study).

#include <string>

#include "core/yaml.h"

namespace rugae {

enum class Inpainting { telea, navier_stokes };

struct ReflectionOptions {
  bool suppress_for_pose = false;  // the paper: suppression hurts the pose ...
  bool suppress_for_map = true;    // ... and helps the map
  Inpainting inpainting = Inpainting::telea;
  int closing_px = 9;  // side of the structuring element, at 640 px width
  double inpaint_radius_px = 3.0;
  void check() const;
};

struct PreprocessOptions {
  ReflectionOptions reflections;
  bool undistort = true;
  bool devignette = true;
  void check() const;
};

struct KeyframeOptions {
  double mean_flow_px = 30.0;  // the paper says 20 and 30; at 640 px width, scaled with the width
  int max_gap = 15;            // frames without a key frame before the best is taken
  void check() const;
};

struct AlignOptions {
  int grid_px = 8;  // spacing of the flow samples handed to RANSAC, at 640 px width
  double ransac_threshold_px = 3.0;
  int patch_radius_px = 15;
  double stop_mse = 1.2340980408667956e-4;  // e^-9, intensities in [0, 1]
  int max_iterations = 100;
  int min_inliers = 30;  // fewer: the pair cannot be aligned
  int neighbours = 3;    // each key frame is aligned to this many before it
  bool affine = true;    // by the method, not an option: whether pairs get the paper's affine
  void check() const;
};

struct TrackOptions {
  double spacing_px = 14.0;  // least distance of the points followed, at 640 px width
  void check() const;
};

struct BundleOptions {
  double huber_px = 1.0;
  double min_parallax_rad = 0.01;
  int max_iterations = 50;
  int min_resection_inliers = 20;
  void check() const;
};

struct MosaicOptions {
  double max_view_angle_rad = 0.7853981633974483;  // 45 degrees from the anchor's view
  int bands = 5;
  void check() const;
};

struct ShadingOptions {
  int iterations = 20;
  double w_n = 1e-8;  // Tsai and Shah's W_n
  double s_0 = 0.01;  // and S_0
  void check() const;
};

struct MapOptions {
  double voxel_share = 1.0 / 256.0;  // of the map's extent
  void check() const;
};

/// Of `dense`: wall seen again.
struct RevisitOptions {
  int neighbours = 1;       // in place of AlignOptions': what is seen again ties further apart
  int rounds = 2;           // of looking for it and adjusting all; 0: none
  double search_px = 24.0;  // around where a point should be seen, at 640 px width
  void check() const;
};

/// Of `dense`: its map.
inline constexpr int kComparedMaps = 12;  // other depth maps that each is held against

struct DenseOptions {
  int width_px = 400;              // of a depth map, at most; it shows all that the lens sees
  int max_depth_maps = 200;        // key frames that get one; bounds time and memory
  int depth_maps_a_point = 8;      // wanted: each sparse point in so many of them
  int views = 8;                   // other key frames each is compared with
  int window_radius_px = 4;        // of the correlation, in the depth map's pixels
  double min_score = 0.45;         // correlation of a depth that is believed
  double max_sigma_share = 0.05;   // standard deviation of a depth that is believed, over the depth
  int consistent_maps = 1;         // other depth maps that must agree
  double consistent_sigmas = 2.0;  // within so many joint standard deviations
  /// Standard deviation, over the depth, of a wall that nothing shows between what stereo found; 0:
  /// gaps are left open, and not looked at again.
  double gap_sigma_share = 0.006;
  double voxel_px = 4.0;  // side of a voxel, in the wall's width of a depth map's pixel
  void check() const;
};

inline const std::vector<std::string> kMethods = {"paper", "dense"};

struct ReconOptions {
  std::string method = "paper";
  PreprocessOptions preprocess;
  KeyframeOptions keyframes;
  AlignOptions align;
  TrackOptions tracks;
  BundleOptions bundle;
  MosaicOptions mosaic;
  ShadingOptions shading;
  MapOptions map;
  RevisitOptions revisits;
  DenseOptions dense;
  bool pictures = true;  // intermediates for people
  std::uint64_t seed = 1;
  void check() const;
};

/// Reads the keys of a `recon:` mapping onto the options and finishes it.
void read_options(YamlReader yaml, ReconOptions& options);
/// All options as canonical JSON text, for the estimate.
std::string to_json_text(const ReconOptions& options);

}  // namespace rugae
