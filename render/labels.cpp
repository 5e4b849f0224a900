#include "render/labels.h"

#include <cmath>
#include <limits>

namespace rugae {

FrameTruth empty_truth(int width, int height, bool has_next) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  FrameTruth truth;
  truth.depth_mm = cv::Mat(height, width, CV_32F, cv::Scalar(nan));
  truth.normal = cv::Mat(height, width, CV_32FC3, cv::Scalar::all(nan));
  if (has_next) truth.flow_px = cv::Mat(height, width, CV_32FC2, cv::Scalar::all(nan));
  truth.masks = cv::Mat(height, width, CV_8U, cv::Scalar(0));
  return truth;
}

void label_tile(const Tile& tile, const RayTable& rays, const Surface& surface,
                const Raycaster& raycaster, const LensProjector& lens, const LabelView& view,
                FrameTruth& truth) {
  const Mat3 cam_from_world =
      view.world_from_camera.rotation.toRotationMatrix().transpose();  // rotation alone
  const Vec3 eye = view.world_from_camera.translation;
  const Vec3 next_eye =
      view.next_world_from_camera ? view.next_world_from_camera->translation : eye;
  Mat3 next_rotation = Mat3::Identity();  // next camera from world
  if (view.next_world_from_camera)
    next_rotation = view.next_world_from_camera->rotation.toRotationMatrix().transpose();

  // In a closed mesh a wall point turned away from the next camera is hidden without tracing.
  Lanes<Vec3> point_world;
  Lanes<std::uint8_t> lands, faces_next, hidden;
  for (int lane = 0; lane < tile.count; ++lane) {
    lands[lane] = faces_next[lane] = 0;
    const Hit& hit = tile.hit[lane];
    if (!hit.met()) continue;
    const int i = tile.pixel[lane];
    const Vec3 ray_cam = rays.directions_cam[i];
    truth.depth_mm.ptr<float>()[i] = static_cast<float>(hit.range_mm * ray_cam.z());
    const Vec3 winding = surface.geometric_normal(hit.triangle).cast<double>();
    const Vec3 normal = winding.dot(tile.direction_world[lane]) > 0.0 ? Vec3(-winding) : winding;
    truth.normal.ptr<Vec3f>()[i] = (cam_from_world * normal).cast<float>();
    truth.masks.ptr<unsigned char>()[i] |= kMaskValid;

    if (!view.next_world_from_camera) continue;
    point_world[lane] = eye + hit.range_mm * tile.direction_world[lane];
    const Vec3 from_next = point_world[lane] - next_eye;
    const auto landing = lens.project(next_rotation * from_next);
    if (!landing || landing->x() < 0.0 || landing->y() < 0.0 || landing->x() >= rays.width ||
        landing->y() >= rays.height)
      continue;
    lands[lane] = 1;
    faces_next[lane] = normal.dot(from_next) < 0.0;
    const Vec2 flow = *landing - Vec2(i % rays.width + 0.5, i / rays.width + 0.5);
    truth.flow_px.ptr<Vec2f>()[i] = flow.cast<float>();
  }
  if (!view.next_world_from_camera) return;

  const auto n = static_cast<std::size_t>(tile.count);
  raycaster.hidden_from(next_eye, {point_world.data(), n}, {faces_next.data(), n},
                        {hidden.data(), n});
  for (int lane = 0; lane < tile.count; ++lane) {
    if (!lands[lane]) continue;
    unsigned char& mask = truth.masks.ptr<unsigned char>()[tile.pixel[lane]];
    mask |= kMaskFlowValid;
    if (!faces_next[lane] || hidden[lane]) mask |= kMaskFlowOccluded;
  }
}

}  // namespace rugae
