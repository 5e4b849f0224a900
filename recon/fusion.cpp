// The placed mosaics become one mesh: truncated signed distances (Curless and Levoy, SIGGRAPH 1996,
// doi:10.1145/237170.237269) on Open3D's hashed voxel blocks, then marching cubes.

#include <open3d/camera/PinholeCameraIntrinsic.h>
#include <open3d/geometry/Image.h>
#include <open3d/geometry/RGBDImage.h>
#include <open3d/geometry/TriangleMesh.h>
#include <open3d/pipelines/integration/ScalableTSDFVolume.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "core/one_thread.h"
#include "recon/map.h"
#include "recon/mesh_pieces.h"
#include "recon/pinhole.h"

namespace rugae {
namespace {

namespace tsdf = open3d::pipelines::integration;

/// Distances are trusted to this many voxels on either side of a surface.
constexpr double kTruncationVoxels = 5.0;
/// The map's extent is the diagonal of the box that holds the points between these percentiles each
/// way.
constexpr double kLowShare = 0.02, kHighShare = 0.98;
/// Points of the depth pictures looked at for the extent: every so many pixels each way.
constexpr int kExtentStride = 8;
/// Pieces with less than this share of the triangles of the largest piece are noise.
constexpr double kSmallestPiece = 0.01;
/// A depth beyond this many times the median depth of its mosaic is not believed.
constexpr double kMaxOverMedian = 4.0;

/// Diagonal of the robust bounding box of all depths, in world coordinates; 0 without any.
double extent_of(const std::vector<DepthView>& views) {
  std::array<std::vector<double>, 3> coordinates;
  for (const DepthView& view : views) {
    const Rigid3 world_from_cam = view.cam_from_world.inverse();
    for (int y = 0; y < view.depth.rows; y += kExtentStride)
      for (int x = 0; x < view.depth.cols; x += kExtentStride) {
        const double z = view.depth.at<float>(y, x);
        if (z == 0.0) continue;
        const Vec3 p_world =
            world_from_cam * Vec3((x - view.cx) / view.fx * z, (y - view.cy) / view.fy * z, z);
        for (int axis = 0; axis < 3; ++axis) coordinates[axis].push_back(p_world[axis]);
      }
  }
  if (coordinates[0].empty()) return 0.0;
  Vec3 size;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double>& values = coordinates[axis];
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
      return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    };
    size[axis] = at(kHighShare) - at(kLowShare);
  }
  return size.norm();
}

open3d::geometry::RGBDImage rgbd_of(const DepthView& view) {
  open3d::geometry::RGBDImage image;
  image.depth_.Prepare(view.depth.cols, view.depth.rows, 1, 4);
  image.color_.Prepare(view.bgr.cols, view.bgr.rows, 3, 1);
  cv::Mat rgb;
  cv::cvtColor(view.bgr, rgb, cv::COLOR_BGR2RGB);
  check(view.depth.isContinuous() && rgb.isContinuous(), "fuse_views: pictures are not continuous");
  std::memcpy(image.depth_.data_.data(), view.depth.data, image.depth_.data_.size());
  std::memcpy(image.color_.data_.data(), rgb.data, image.color_.data_.size());
  return image;
}

}  // namespace

DepthView depth_view(const Mosaic& mosaic, const MosaicDepth& placed, const Structure& structure,
                     const Lens& lens) {
  DepthView view{placed.depth.clone(),
                 mosaic.bgr,
                 lens.fx,
                 lens.fy,
                 lens.cx - mosaic.origin_px.x() - 0.5,
                 lens.cy - mosaic.origin_px.y() - 0.5,
                 structure.cam_from_world[mosaic.anchor]};
  if (!is_pinhole(lens)) {
    // Frames kept with their distortion: each pinhole pixel takes from where the lens images it.
    const LensProjector projector(lens);
    cv::Mat source(placed.depth.size(), CV_32FC2, cv::Scalar::all(-1.0));
    for (int y = 0; y < source.rows; ++y)
      for (int x = 0; x < source.cols; ++x) {
        const auto pixel =
            projector.project(Vec3((x - view.cx) / view.fx, (y - view.cy) / view.fy, 1.0));
        if (!pixel) continue;
        const Vec2 from = *pixel - mosaic.origin_px - Vec2(0.5, 0.5);
        source.at<cv::Vec2f>(y, x) = {static_cast<float>(from.x()), static_cast<float>(from.y())};
      }
    cv::remap(placed.depth, view.depth, source, {}, cv::INTER_NEAREST, cv::BORDER_CONSTANT,
              cv::Scalar::all(0.0));
    cv::remap(mosaic.bgr, view.bgr, source, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  }
  std::vector<float> known;
  for (int y = 0; y < view.depth.rows; ++y)
    for (int x = 0; x < view.depth.cols; ++x)
      if (view.depth.at<float>(y, x) > 0.0f) known.push_back(view.depth.at<float>(y, x));
  float far = 0.0f;
  if (!known.empty()) {
    const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
    std::nth_element(known.begin(), middle, known.end());
    far = static_cast<float>(kMaxOverMedian) * *middle;
  }
  for (int y = 0; y < view.depth.rows; ++y)
    for (int x = 0; x < view.depth.cols; ++x) {
      float& z = view.depth.at<float>(y, x);
      if (!(z > 0.0f && z <= far)) z = 0.0f;  // Open3D's mark for unknown
    }
  return view;
}

TriangleMesh fuse_views(std::vector<DepthView> views, const MapOptions& options) {
  options.check();
  const double extent = extent_of(views);
  if (!(extent > 0.0)) return {};

  // Open3D works in the map's own units; the map is scaled to an extent of one, so that its fixed
  // tolerances mean the same for every scale.
  const double voxel = options.voxel_share;
  // Open3D starts its threads anew for each block of 16^3 voxels, which is less work than the wait
  // for them: ten times the time where processors are busy elsewhere.
  const OneOpenMpThread one_thread;
  tsdf::ScalableTSDFVolume volume(voxel, kTruncationVoxels * voxel,
                                  tsdf::TSDFVolumeColorType::RGB8);
  for (DepthView& view : views) {
    view.depth /= extent;
    Mat4 cam_from_world = Mat4::Identity();
    cam_from_world.topRows<3>() = view.cam_from_world.matrix3x4();
    cam_from_world.topRightCorner<3, 1>() /= extent;
    const open3d::camera::PinholeCameraIntrinsic pinhole(view.depth.cols, view.depth.rows, view.fx,
                                                         view.fy, view.cx, view.cy);
    volume.Integrate(rgbd_of(view), pinhole, cam_from_world);
    view = {};  // the volume grows as the pictures go
  }
  const auto fused = volume.ExtractTriangleMesh();

  TriangleMesh mesh;
  for (const Vec3& vertex : fused->vertices_) mesh.vertices.push_back(vertex * extent);
  for (const Vec3& color : fused->vertex_colors_)
    mesh.colors.push_back((color.cwiseMin(1.0).cwiseMax(0.0)).cast<float>());
  // Marching cubes winds towards the cameras; our normals point out of the lumen.
  for (const Vec3i& t : fused->triangles_) mesh.triangles.emplace_back(t[0], t[2], t[1]);
  mesh = part_of(mesh, vertices_of_large_pieces(mesh, kSmallestPiece));
  mesh.normals = angle_weighted_normals(mesh);
  return mesh;
}

}  // namespace rugae
