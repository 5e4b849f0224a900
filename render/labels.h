#pragma once
// Truth of a frame, worked out tile by tile from the exact hits.

#include "dataset/label_images.h"
#include "dataset/truth.h"
#include "render/motion.h"
#include "render/tile.h"

namespace rugae {

/// Matrices of the frame's size of the wanted labels, to be filled tile by tile, and masks in any
/// case, which are 0; flow only where there is a frame to flow to.
FrameTruth new_truth(int width, int height, bool has_previous, bool has_next,
                     const LabelSet& labels);

/// The pixels of a label, row by row; null where there is no such label.
template <typename T>
T* pixels(cv::Mat& label) {
  return label.empty() ? nullptr : label.ptr<T>();
}

/// A frame beside the one that is labelled.
struct OtherFrame {
  const FrameView& view;
  const Wall& wall;
};

struct LabelView {
  const Wall& wall;
  const OtherFrame* previous = nullptr;  // null: no flow to it
  const OtherFrame* next = nullptr;
};

/// Writes into every label that the tile's rays which met no wall saw none (light: 0).
void label_nothing(const Tile& tile, FrameTruth& truth);

/// Writes depth, range, normal, flow, triangle and the masks valid, flow valid and flow occluded of
/// the tile's pixels that met the wall, as far as `truth` has them.
///
/// Flow leads to where the same material point (triangle and barycentric coordinates) lands in the
/// other frame, at the time at which the row it lands in is exposed. It is occluded there when the
/// wall at the point is turned away from the camera, or when a ray from the camera at that time to
/// the point meets wall before Raycaster::kReach of the way; depths or triangles are not compared.
/// Safe for different tiles at once.
void label_tile(const Tile& tile, const RayTable& rays, const LensProjector& lens,
                const LabelView& view, FrameTruth& truth);

/// Writes shading normal, albedo, region and instance likewise.
void label_surface(const Tile& tile, const SurfaceTile& surface, FrameTruth& truth);

}  // namespace rugae
