// Depth of the map as a key frame sees it: each triangle is handed to the pixels it may cover, and
// each pixel's own ray is intersected with it, so the lens is exact.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/units.h"
#include "recon/map.h"

namespace rugae {
namespace {

/// A straight edge is curved by the lens, by an amount that grows with the square of its length:
/// the box around the projected corners grows by a quarter of its size once it measures this share
/// of the picture's width, by the square's part of that before, and by a little for rounding.
constexpr double kCurvedShare = 0.125;
constexpr double kCurvedEdgeMargin = 0.25;
constexpr double kRoundingPx = 0.05;
/// A ray at a corner of the triangle must not be lost to rounding.
constexpr double kCosineRounding = 1e-12;

struct Corner {
  Vec3 p_cam;
  std::optional<Vec2> pixel;
};

/// A triangle for rays from the origin (Moeller and Trumbore, 1997,
/// doi:10.1080/10867651.1997.10487468). Their determinant and barycentric coordinates are triple
/// products with the ray, whose other factors are the triangle's alone:
///   det = ray . (ac x ab),   u = ray . (a x ac) / det,   v = ray . (ab x a) / det,
///   distance = ac . (ab x a) / det.
class Facet {
 public:
  Facet(const Vec3& a, const Vec3& ab, const Vec3& ac)
      : determinant_(ac.cross(ab)), u_(a.cross(ac)), v_(ab.cross(a)), distance_(ac.dot(v_)) {}

  /// Distance along `ray` to the triangle's plane where the ray meets its inside, either side;
  /// negative when it misses.
  double hit(const Vec3& ray) const {
    const double determinant = ray.dot(determinant_);
    if (determinant == 0.0) return -1.0;
    // Neighbours share edges exactly; a rounding error must not open a slit between them.
    constexpr double kEdge = 1e-9;
    // Most rays miss: they are told by products with the determinant, without a division.
    const double size = std::abs(determinant), sign = determinant > 0.0 ? 1.0 : -1.0;
    const double u = sign * ray.dot(u_), v = sign * ray.dot(v_), slack = kEdge * size;
    if (!(u >= -slack && v >= -slack && u + v <= size + slack)) return -1.0;
    return distance_ * (1.0 / determinant);
  }

 private:
  Vec3 determinant_, u_, v_;
  double distance_;
};

/// The directions in which a triangle may be seen: those within an angle of the centre of the
/// sphere around it; all of them when the eye is inside that sphere.
struct Directions {
  Vec3 centre = Vec3::UnitZ();
  double half_angle_rad = kPi;
};

Directions directions_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 middle = (a + b + c) / 3.0;
  const double radius = std::sqrt(std::max(
      {(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
  const double distance = middle.norm();
  if (!(distance > radius)) return {};
  return {middle / distance, std::asin(radius / distance)};
}

/// Largest angle of a ray from the axis.
double widest_angle_rad(const std::vector<Vec3>& rays) {
  double smallest_z = 1.0;
  for (const Vec3& ray : rays)
    if (ray.z() > 0.0) smallest_z = std::min(smallest_z, ray.z());
  return std::acos(smallest_z);
}

}  // namespace

std::vector<Vec3> pixel_rays(const Lens& lens) {
  const LensProjector projector(lens);
  std::vector<Vec3> rays(static_cast<std::size_t>(lens.width) * lens.height, Vec3::Zero());
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x)
      if (const auto ray = projector.unproject({x + 0.5, y + 0.5});
          ray && lens.passes_stop({x + 0.5, y + 0.5}))
        rays[static_cast<std::size_t>(y) * lens.width + x] = *ray;
  return rays;
}

cv::Mat keyframe_depth(const TriangleMesh& map, const Rigid3& cam_from_world,
                       const Lens& original_lens) {
  const RollingShutter global(original_lens, original_lens, 0.0);
  return keyframe_depth(map, {cam_from_world, {}}, global, pixel_rays(original_lens));
}

cv::Mat keyframe_depth(const TriangleMesh& map, const MovingPose& camera,
                       const RollingShutter& shutter, const std::vector<Vec3>& rays) {
  const Lens& lens = shutter.original();
  check(rays.size() == static_cast<std::size_t>(lens.width) * lens.height,
        "keyframe_depth: {} rays for {} x {} pixels", rays.size(), lens.width, lens.height);
  cv::Mat depth(lens.height, lens.width, CV_32F,
                cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  const double picture_angle_rad = widest_angle_rad(rays);
  std::vector<Corner> corners;
  corners.reserve(map.vertices.size());
  for (const Vec3& vertex : map.vertices) {
    const Vec3 at_frame_time = camera.cam_from_world * vertex;
    const Vec3 p_cam = shutter.when_seen(at_frame_time, camera.motion).value_or(at_frame_time);
    corners.push_back({p_cam, p_cam.z() > 0.0 ? shutter.project_original(p_cam) : std::nullopt});
  }
  for (const Vec3i& triangle : map.triangles) {
    const std::array<const Corner*, 3> c = {&corners[triangle[0]], &corners[triangle[1]],
                                            &corners[triangle[2]]};
    if (std::max({c[0]->p_cam.z(), c[1]->p_cam.z(), c[2]->p_cam.z()}) <= 0.0) continue;  // behind
    Eigen::AlignedBox2d box;
    int projected = 0;
    for (const Corner* corner : c)
      if (corner->pixel) box.extend(*corner->pixel), ++projected;
    const double size_px = projected == 3 ? box.sizes().maxCoeff() : 0.0;
    const double curved = std::min(1.0, size_px / (kCurvedShare * lens.width));
    Directions seen;
    if (projected < 3 || curved == 1.0) {
      // Far off the axis the lens maps the little that a triangle spans to boxes of any size: what
      // counts there are directions.
      seen = directions_of(c[0]->p_cam, c[1]->p_cam, c[2]->p_cam);
      const double off_axis_rad = std::acos(std::clamp(seen.centre.z(), -1.0, 1.0));
      if (off_axis_rad - seen.half_angle_rad > picture_angle_rad) continue;
    }
    // Part of a triangle that is not projected whole may cover anything within its cone.
    if (projected < 3) box = {Vec2(0, 0), Vec2(lens.width, lens.height)};
    const double margin = kRoundingPx + kCurvedEdgeMargin * curved * size_px;
    // Pixels with centres in the box, which may lie farther off than an int counts.
    const double first_x = std::max(0.0, std::ceil(box.min().x() - margin - 0.5));
    const double first_y = std::max(0.0, std::ceil(box.min().y() - margin - 0.5));
    const double last_x = std::min(lens.width - 1.0, std::floor(box.max().x() + margin - 0.5));
    const double last_y = std::min(lens.height - 1.0, std::floor(box.max().y() + margin - 0.5));
    if (!(first_x <= last_x && first_y <= last_y)) continue;
    const int left = static_cast<int>(first_x), right = static_cast<int>(last_x);
    const int top = static_cast<int>(first_y), bottom = static_cast<int>(last_y);
    const bool everywhere = seen.half_angle_rad == kPi;
    const double seen_cosine = std::cos(seen.half_angle_rad) - kCosineRounding;
    const Facet facet(c[0]->p_cam, c[1]->p_cam - c[0]->p_cam, c[2]->p_cam - c[0]->p_cam);
    for (int y = top; y <= bottom; ++y) {
      const Vec3* row = &rays[static_cast<std::size_t>(y) * lens.width];
      auto* nearest = depth.ptr<float>(y);
      for (int x = left; x <= right; ++x) {
        const Vec3& ray = row[x];
        if (!(ray.z() > 0.0) || (!everywhere && ray.dot(seen.centre) < seen_cosine)) continue;
        const double z = facet.hit(ray) * ray.z();
        if (z > 0.0 && !(nearest[x] <= z)) nearest[x] = static_cast<float>(z);
      }
    }
  }
  return depth;
}

}  // namespace rugae
