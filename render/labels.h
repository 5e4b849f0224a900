#pragma once
// Truth of a frame, worked out tile by tile from the exact hits.

#include "dataset/truth.h"
#include "render/raycaster.h"
#include "render/surface.h"

namespace rugae {

/// Matrices of the frame's size, filled with "nothing was hit"; flow only when there is a next
/// frame.
FrameTruth empty_truth(int width, int height, bool has_next);

struct LabelView {
  Rigid3 world_from_camera;
  const Rigid3* next_world_from_camera = nullptr;  // null for the last frame
};

/// Writes depth, normal, flow and the masks valid, flow valid and flow occluded of the tile's
/// pixels. Occlusion is found by a ray from the next camera's centre to the wall point, not by
/// comparing depths or triangles. Safe for different tiles at once.
void label_tile(const Tile& tile, const RayTable& rays, const Surface& surface,
                const Raycaster& raycaster, const LensProjector& lens, const LabelView& view,
                FrameTruth& truth);

}  // namespace rugae
