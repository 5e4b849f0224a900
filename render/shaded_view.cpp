#include "render/shaded_view.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/check.h"
#include "core/units.h"
#include "render/raycaster.h"

namespace rugae {
namespace {

// Of the light that reaches the camera from a wall seen edge-on: keeps outlines readable.
constexpr float kAmbient = 0.25f;
// Beyond a triangle that is left out, a share of the mesh's size: well over the slack of the
// traversal (kSwell in render/raycaster.cpp), which would propose the same triangle again.
constexpr double kStepPast = 1e-5;

// The first hit of a ray that is not left out.
Hit hit_of(const TriangleMesh& mesh, const Raycaster& raycaster, const Vec3& eye, const Vec3& ray,
           Hit hit, double step_past_mm, const ShadedViewOptions& options) {
  Vec3 from = eye;
  constexpr int kMostLayers = 64;
  for (int layer = 0; options.cull_front && hit.met() && layer < kMostLayers; ++layer) {
    if (triangle_normal(mesh, hit.triangle).dot(ray) > 0.0) break;
    from += (hit.range_mm + step_past_mm) * ray;
    hit = raycaster.intersect(from, ray);
  }
  return hit;
}

Vec3f blended(const std::vector<Vec3f>& values, const Vec3i& corners, const Hit& hit) {
  return (1.0f - hit.b1 - hit.b2) * values[corners[0]] + hit.b1 * values[corners[1]] +
         hit.b2 * values[corners[2]];
}

// Share of a colour that is left where a ray meets the mesh.
float shade(const TriangleMesh& mesh, const Hit& hit, const Vec3& ray) {
  Vec3f normal = triangle_normal(mesh, hit.triangle).cast<float>();
  if (!mesh.normals.empty())
    normal = blended(mesh.normals, mesh.triangles[hit.triangle], hit).normalized();
  const float cosine = std::min(1.0f, std::abs(normal.dot(ray.cast<float>())));
  return kAmbient + (1.0f - kAmbient) * cosine;
}

}  // namespace

std::vector<ColouredView> coloured_views(const TriangleMesh& mesh,
                                         std::span<const std::vector<Vec3f>> colourings,
                                         const Rigid3& cam_from_world, const Lens& lens,
                                         const ShadedViewOptions& options) {
  check(options.samples >= 1, "shaded view: samples is {}, expected at least 1", options.samples);
  for (const auto& colours : colourings)
    check(colours.empty() || colours.size() == mesh.vertices.size(),
          "shaded view: {} colours for {} vertices", colours.size(), mesh.vertices.size());
  const Raycaster raycaster(mesh);
  const LensProjector projector(lens);
  const Rigid3 world_from_cam = cam_from_world.inverse();
  const Vec3& eye = world_from_cam.translation;
  const double step_past_mm = kStepPast * bounding_box(mesh).diagonal().norm();
  std::vector<ColouredView> views(colourings.size());
  for (ColouredView& view : views) {
    view.bgr.create(lens.height, lens.width, CV_8UC3);
    view.covered.create(lens.height, lens.width, CV_32F);
  }
  const int per_pixel = options.samples * options.samples;
  tbb::parallel_for(0, lens.height, [&](int y) {
    std::vector<Vec3> rays;  // zero where the lens sees nothing
    for (int x = 0; x < lens.width; ++x)
      for (int s = 0; s < per_pixel; ++s) {
        const auto ray = projector.unproject({x + (s % options.samples + 0.5) / options.samples,
                                              y + (s / options.samples + 0.5) / options.samples});
        rays.push_back(ray ? Vec3(world_from_cam.rotation * *ray) : Vec3::Zero());
      }
    std::vector<Hit> hits(rays.size());
    std::vector<float> shades(rays.size());
    raycaster.intersect(eye, rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      hits[i] = hit_of(mesh, raycaster, eye, rays[i], hits[i], step_past_mm, options);
      if (hits[i].met()) shades[i] = shade(mesh, hits[i], rays[i]);
    }
    for (std::size_t k = 0; k < views.size(); ++k)
      for (int x = 0; x < lens.width; ++x) {
        Vec3f sum = Vec3f::Zero();
        int met = 0;
        for (int i = x * per_pixel; i < (x + 1) * per_pixel; ++i) {
          const Hit& hit = hits[i];
          if (!hit.met()) {
            sum += options.background_srgb;
            continue;
          }
          ++met;
          const Vec3f colour = colourings[k].empty()
                                   ? options.clay_srgb
                                   : blended(colourings[k], mesh.triangles[hit.triangle], hit);
          sum += colour * shades[i];
        }
        sum *= 255.0f / static_cast<float>(per_pixel);
        for (int c = 0; c < 3; ++c)
          views[k].bgr.at<cv::Vec3b>(y, x)[2 - c] =
              static_cast<unsigned char>(std::clamp(sum[c] + 0.5f, 0.0f, 255.0f));
        views[k].covered.at<float>(y, x) = static_cast<float>(met) / static_cast<float>(per_pixel);
      }
  });
  return views;
}

cv::Mat shaded_view(const TriangleMesh& mesh, const Rigid3& cam_from_world, const Lens& lens,
                    const ShadedViewOptions& options) {
  return coloured_views(mesh, {&mesh.colors, 1}, cam_from_world, lens, options).front().bgr;
}

Lens picture_lens(int width, int height) {
  Lens lens;
  lens.width = width;
  lens.height = height;
  constexpr double kFieldOfView_rad = rad_from_deg(30.0);
  lens.fx = lens.fy = 0.5 * std::min(width, height) / std::tan(0.5 * kFieldOfView_rad);
  lens.cx = 0.5 * width;
  lens.cy = 0.5 * height;
  return lens;
}

Rigid3 view_of_box(const Eigen::AlignedBox3d& box, const Vec3& from_world, const Vec3& up_world,
                   const Lens& lens) {
  const Vec3 back = from_world.normalized();  // the camera's -z
  const Vec3 right = up_world.cross(back).normalized();
  check(right.allFinite() && right.norm() > 0.5, "view: up is along the view");
  Mat3 world_from_cam;
  world_from_cam << right, back.cross(right) * -1.0, -back;
  const Vec3 center = box.center();
  // Far enough that every corner falls into the picture, with a margin.
  constexpr double kMargin = 1.03;
  double distance_mm = 0.0;
  for (int k = 0; k < 8; ++k) {
    const Vec3 corner = world_from_cam.transpose() *
                        (box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)) - center);
    const double half_x = std::min(lens.cx, lens.width - lens.cx) / lens.fx,
                 half_y = std::min(lens.cy, lens.height - lens.cy) / lens.fy;
    const double needed = std::max(std::abs(corner.x()) / half_x, std::abs(corner.y()) / half_y);
    distance_mm = std::max(distance_mm, kMargin * needed - corner.z());
  }
  return Rigid3(world_from_cam, center + distance_mm * back).inverse();
}

}  // namespace rugae
