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

namespace rugae {

/// A mosaic's depth on its own pixel grid: z-depth in the anchor's camera, map units, NaN where
/// unknown.
struct MosaicDepth {
  cv::Mat depth;          // CV_32F
  int sparse_points = 0;  // that placed it
  double residual = 0.0;  // RMS of depth against the sparse points, map units
};

/// Tsai and Shah's relief fitted to the sparse points seen in the mosaic; empty when too few points
/// fix it.
std::optional<MosaicDepth> place_mosaic(const Mosaic& mosaic, const Structure& structure,
                                        const Lens& lens, const ShadingOptions& options);

/// Fuses the placed mosaics (TSDF) into one coloured mesh.
TriangleMesh fuse_map(const std::vector<Mosaic>& mosaics,
                      const std::vector<std::optional<MosaicDepth>>& depths,
                      const Structure& structure, const Lens& lens, const MapOptions& options);

/// z-depth of every key frame on the ORIGINAL (distorted) pixel grid, from the fused map by
/// projection; NaN where the map has nothing.
cv::Mat keyframe_depth(const TriangleMesh& map, const Rigid3& cam_from_world,
                       const Lens& original_lens);

}  // namespace rugae
