#pragma once
// A picture of a mesh for a page: what it looks like under a lamp at the camera.

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "cameras/camera.h"
#include "core/mesh.h"
#include "core/rigid3.h"

namespace rugae {

struct ShadedViewOptions {
  Vec3f background_srgb = Vec3f::Constant(1.0f);
  Vec3f clay_srgb{0.80f, 0.74f, 0.68f};  // of meshes without vertex colours
  bool cull_front = false;  // leaves out triangles whose normal faces the camera: looks into an
                            // organ from outside
  int samples = 2;          // per pixel and direction, against jagged edges
};

/// CV_8UC3, BGR, of the lens' size; vertex colours where the mesh has them, darkened by the cosine
/// to the camera (no fall-off with distance). Smooth normals when the mesh has them.
cv::Mat shaded_view(const TriangleMesh& mesh, const Rigid3& cam_from_world, const Lens& lens,
                    const ShadedViewOptions& options = {});

/// One colouring of a mesh as a camera sees it.
struct ColouredView {
  cv::Mat bgr;      // as of shaded_view
  cv::Mat covered;  // CV_32F: share of the pixel that is mesh, the rest being background
};

/// The same of several colourings of one mesh, which is traced once: each holds a colour a vertex,
/// or none for clay. The mesh's own colours are not looked at.
std::vector<ColouredView> coloured_views(const TriangleMesh& mesh,
                                         std::span<const std::vector<Vec3f>> colourings,
                                         const Rigid3& cam_from_world, const Lens& lens,
                                         const ShadedViewOptions& options = {});

/// A camera that sees the whole box from direction `from_world` (from the box's centre towards the
/// eye), `up_world` up; the lens is a pinhole of 30 degrees.
Rigid3 view_of_box(const Eigen::AlignedBox3d& box, const Vec3& from_world, const Vec3& up_world,
                   const Lens& lens);
Lens picture_lens(int width, int height);

}  // namespace rugae
