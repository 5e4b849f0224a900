#pragma once
// The map: shading depth of each mosaic, scaled and placed by the sparse points, fused into one
// textured mesh in world coordinates.

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "recon/mosaic.h"
#include "recon/options.h"
#include "recon/shading.h"

namespace rugae {

/// A mosaic's depth on its own pixel grid: z-depth in the anchor's camera, map units, NaN where
/// unknown.
struct MosaicDepth {
  cv::Mat depth;          // CV_32F
  int sparse_points = 0;  // that placed it
  int rejected = 0;       // points that disagree with their neighbours
  double residual = 0.0;  // RMS of depth against the sparse points, map units
  double held_out = 0.0;  // mean absolute error at points left out of the fit, relative to depth
  double relief_scale = 0.0;  // of the shading relief; 1 where shading alone is right, 0 where it
                              // tells nothing, negative where convex and concave are swapped
  LightEstimate light;
};

/// Tsai and Shah's relief fitted to the sparse points seen in the mosaic,
///   ln z(pixel) = smooth(pixel) + relief_scale * highpass(relief)(pixel) / f,
/// both unknowns jointly; empty when too few points fix it. The depth ends where points end.
std::optional<MosaicDepth> place_mosaic(const Mosaic& mosaic, const Structure& structure,
                                        const Lens& lens, const ShadingOptions& options);

/// A placed mosaic as fusion takes it: seven bytes a pixel.
struct DepthView {
  cv::Mat depth;          // CV_32F, of a pinhole, map units; 0 where unknown or not believed
  cv::Mat bgr;            // CV_8UC3, may be the mosaic's own
  double fx, fy, cx, cy;  // whole-numbered pixel centres
  Rigid3 cam_from_world;
};

DepthView depth_view(const Mosaic& mosaic, const MosaicDepth& placed, const Structure& structure,
                     const Lens& lens);

/// Fuses the placed mosaics (TSDF) into one coloured mesh; geometric normals point away from the
/// cameras. Small pieces that hang in the air are left out. Empty without any depth.
TriangleMesh fuse_views(std::vector<DepthView> views, const MapOptions& options);

/// z-depth (CV_32F) of a key frame on the ORIGINAL (distorted) pixel grid, from the fused map: the
/// nearest triangle on each pixel's ray; NaN where the map has nothing.
cv::Mat keyframe_depth(const TriangleMesh& map, const Rigid3& cam_from_world,
                       const Lens& original_lens);

/// The same with the lens' pixel_rays at hand, for many key frames of one lens.
/// With a rolling shutter depth is that at the time of the pixel's row.
cv::Mat keyframe_depth(const TriangleMesh& map, const MovingPose& camera,
                       const RollingShutter& shutter, const std::vector<Vec3>& rays);
/// Unit rays through all pixel centres, row by row; zero where the lens has none and outside its
/// field stop.
std::vector<Vec3> pixel_rays(const Lens& lens);

}  // namespace rugae
