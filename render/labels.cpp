#include "render/labels.h"

#include <cmath>
#include <limits>

namespace rugae {
namespace {

constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();

// What flow in either direction needs of a lane.
struct Seen {
  bool met;
  Vec3 point_world;
  Vec3 normal_world;  // of the triangle, towards the camera
  double side;        // -1 where the winding normal points away from the camera, 1 elsewhere
};

// Where a material point of this frame's wall is at a time of the other frame.
class Follow {
 public:
  Follow(const Tile& tile, const Wall& wall, const OtherFrame& other)
      : tile_(tile), wall_(wall), other_(other), still_(&wall == &other.wall) {}

  bool still() const { return still_; }
  Vec3 point(int lane, const Seen& seen, double offset_s) const {
    if (still_) return seen.point_world;
    const Hit& hit = tile_.hit[lane];
    return seen.point_world + (other_.wall.point(hit, other_.view.beat(offset_s)) -
                               wall_.point(hit, tile_.instant_of(lane).beat));
  }

 private:
  const Tile& tile_;
  const Wall& wall_;
  const OtherFrame& other_;
  bool still_;
};

struct FlowOut {
  cv::Mat& flow_px;
  unsigned char valid, occluded;  // bits of the mask
};

void label_flow(const Tile& tile, const LensProjector& lens, const Wall& wall,
                const OtherFrame& other, const Lanes<Seen>& seen, const FlowOut& out,
                cv::Mat& masks) {
  const Follow follow(tile, wall, other);
  auto* const flow_px = out.flow_px.ptr<Vec2f>();
  auto* const mask = masks.ptr<unsigned char>();
  const RowPoses& camera = other.view.camera;
  Rigid3 pose = camera.of_row(0);
  Mat3 cam_from_world = pose.rotation.toRotationMatrix().transpose();  // rotation alone

  // In a closed mesh a wall point turned away from the camera is hidden without tracing.
  Lanes<Vec3> point_world;
  Lanes<std::uint8_t> lands, faces, hidden;
  Lanes<Eye> eyes;
  if (!camera.rolling()) eyes[0] = {pose.translation, 0.0};
  for (int lane = 0; lane < tile.count; ++lane) {
    lands[lane] = faces[lane] = 0;
    if (!seen[lane].met) continue;
    flow_px[tile.pixel[lane]].setConstant(kNowhere);
    const Vec2 pixel(tile.column[lane] + 0.5, tile.row[lane] + 0.5);
    const auto at = [&](double offset_s) { return follow.point(lane, seen[lane], offset_s); };
    double offset_s = 0.0;
    std::optional<Vec2> landing;
    if (camera.rolling()) {
      landing = camera.landing(lens, at, pixel.y());
      if (!landing) continue;
      pose = camera.at(landing->y());
      offset_s = camera.offset_s(landing->y());
      eyes[lane] = {pose.translation, other.view.beat(offset_s)};
      point_world[lane] = at(offset_s);
    } else {
      point_world[lane] = at(0.0);
      landing = lens.project(cam_from_world * (point_world[lane] - pose.translation));
      if (!landing) continue;
    }
    if (!lens.contains(*landing)) continue;
    lands[lane] = 1;
    const Vec3 normal =
        follow.still()
            ? seen[lane].normal_world
            : Vec3(seen[lane].side *
                   other.wall.geometric_normal(tile.hit[lane].triangle, other.view.beat(offset_s)));
    faces[lane] = normal.dot(point_world[lane] - pose.translation) < 0.0;
    flow_px[tile.pixel[lane]] = (*landing - pixel).cast<float>();
  }

  const auto n = static_cast<std::size_t>(tile.count);
  const std::span<const Eye> from(eyes.data(), camera.rolling() ? n : 1);
  other.wall.raycaster().hidden_from(from, {point_world.data(), n}, {faces.data(), n},
                                     {hidden.data(), n});
  for (int lane = 0; lane < tile.count; ++lane) {
    if (!lands[lane]) continue;
    const bool occluded = !faces[lane] || hidden[lane];
    mask[tile.pixel[lane]] |= out.valid | (occluded ? out.occluded : 0);
  }
}

}  // namespace

FrameTruth new_truth(int width, int height, bool has_previous, bool has_next,
                     const LabelSet& labels) {
  FrameTruth truth;
  for (const LabelImage& label : label_images()) {
    if (!(labels.*label.wanted)) continue;
    if (label.wanted == &LabelSet::flow && !has_next) continue;
    if (label.wanted == &LabelSet::backward_flow && !has_previous) continue;
    (truth.*label.image).create(height, width, label.type);
  }
  truth.masks = cv::Mat(height, width, CV_8U, cv::Scalar(0));  // bits are added to it
  return truth;
}

void label_nothing(const Tile& tile, FrameTruth& truth) {
  for (const LabelImage& label : label_images()) {
    cv::Mat& image = truth.*label.image;
    if (image.empty() || &image == &truth.masks) continue;
    const auto channels = static_cast<std::size_t>(image.channels());
    for (int lane = 0; lane < tile.count; ++lane) {
      if (tile.hit[lane].met()) continue;
      const std::size_t first = channels * static_cast<std::size_t>(tile.pixel[lane]);
      for (std::size_t c = first; c < first + channels; ++c) {
        if (image.depth() == CV_32F)
          image.ptr<float>()[c] = static_cast<float>(label.nothing);
        else
          image.ptr<unsigned char>()[c] = static_cast<unsigned char>(label.nothing);
      }
    }
  }
}

void label_tile(const Tile& tile, const RayTable& rays, const LensProjector& lens,
                const LabelView& view, FrameTruth& truth) {
  auto* const depth_mm = pixels<float>(truth.depth_mm);
  auto* const range_mm = pixels<float>(truth.range_mm);
  auto* const normal = pixels<Vec3f>(truth.normal);
  auto* const triangle = pixels<Vec3f>(truth.triangle);
  auto* const masks = pixels<unsigned char>(truth.masks);
  Lanes<Seen> seen;
  for (int lane = 0; lane < tile.count; ++lane) {
    const Hit& hit = tile.hit[lane];
    seen[lane].met = hit.met();
    if (!hit.met()) continue;
    const int i = tile.pixel[lane];
    const Instant& instant = tile.instant_of(lane);
    const Vec3& ray_world = tile.direction_world[lane];
    masks[i] |= kMaskValid;
    if (depth_mm) depth_mm[i] = static_cast<float>(hit.range_mm * rays.directions_cam[i].z());
    if (range_mm) range_mm[i] = static_cast<float>(hit.range_mm);
    if (triangle) triangle[i] = Vec3f(static_cast<float>(hit.triangle), hit.b1, hit.b2);
    if (!normal && !view.next && !view.previous) continue;
    const Vec3 winding = view.wall.geometric_normal(hit.triangle, instant.beat);
    const double side = winding.dot(ray_world) > 0.0 ? -1.0 : 1.0;
    if (normal)
      normal[i] = (instant.world_from_camera.transpose() * (side * winding)).cast<float>();
    seen[lane].point_world = tile.eye_of(lane).position_mm + hit.range_mm * ray_world;
    seen[lane].normal_world = side * winding;
    seen[lane].side = side;
  }
  if (view.next)
    label_flow(tile, lens, view.wall, *view.next, seen,
               {truth.flow_px, kMaskFlowValid, kMaskFlowOccluded}, truth.masks);
  if (view.previous)
    label_flow(tile, lens, view.wall, *view.previous, seen,
               {truth.backward_flow_px, kMaskBackwardFlowValid, kMaskBackwardFlowOccluded},
               truth.masks);
}

void label_surface(const Tile& tile, const SurfaceTile& surface, FrameTruth& truth) {
  auto* const normal = pixels<Vec3f>(truth.shading_normal);
  auto* const albedo = pixels<Vec3f>(truth.albedo);
  auto* const region = pixels<unsigned char>(truth.region);
  auto* const instance = pixels<unsigned char>(truth.instance);
  if (!normal && !albedo && !region && !instance) return;
  for (int k = 0; k < surface.count; ++k) {
    const int lane = surface.lane[k], i = tile.pixel[lane];
    if (normal)
      normal[i] = (tile.instant_of(lane).world_from_camera.transpose() *
                   surface.shading_normal[k].cast<double>())
                      .cast<float>();
    if (albedo) albedo[i] = surface.material[k].albedo;
    if (region) region[i] = static_cast<unsigned char>(surface.query[k].region);
    if (instance) instance[i] = surface.material[k].instance;
  }
}

}  // namespace rugae
