#include "validate/visibility.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/check.h"
#include "core/units.h"

namespace rugae {
namespace {

// The largest depth of the four pixels around a place in the image; NaN where none hit the wall.
float depth_around(const cv::Mat& depth_mm, const Vec2& pixel) {
  const int x0 = static_cast<int>(std::floor(pixel.x() - 0.5));
  const int y0 = static_cast<int>(std::floor(pixel.y() - 0.5));
  float largest = std::numeric_limits<float>::quiet_NaN();
  for (int y = std::max(y0, 0); y <= std::min(y0 + 1, depth_mm.rows - 1); ++y)
    for (int x = std::max(x0, 0); x <= std::min(x0 + 1, depth_mm.cols - 1); ++x) {
      const float depth = depth_mm.at<float>(y, x);
      if (!std::isnan(depth) && !(depth <= largest)) largest = depth;
    }
  return largest;
}

}  // namespace

void VisibilityOptions::check() const {
  rugae::check(max_incidence_rad > 0.0 && max_incidence_rad <= 0.5 * kPi,
               "visibility: max_incidence_rad is {}, expected above 0 and at most pi/2",
               max_incidence_rad);
  rugae::check(depth_margin_mm >= 0.0 && depth_margin_share >= 0.0,
               "visibility: depth margins are {} mm and {}, expected at least 0", depth_margin_mm,
               depth_margin_share);
}

Visibility::Visibility(const TriangleMesh& wall, const VisibilityOptions& options)
    : wall_(wall),
      options_(options),
      seen_(wall.triangles.size(), 0),
      seen_well_(wall.triangles.size(), 0) {
  options_.check();
  at_rest_.reserve(wall.triangles.size());
  for (std::size_t t = 0; t < wall.triangles.size(); ++t) at_rest_.push_back(patch_of(wall, t));
}

Visibility::Patch Visibility::patch_of(const TriangleMesh& wall, std::size_t t) {
  const Vec3i& i = wall.triangles[t];
  return {(wall.vertices[i[0]] + wall.vertices[i[1]] + wall.vertices[i[2]]) / 3.0,
          triangle_normal(wall, t)};
}

// Calls see(t) for each triangle that this frame sees: of different triangles at the same time.
template <typename PatchAt, typename See>
void Visibility::look(const Lens& lens, const RowPoses& camera, const cv::Mat& depth_mm,
                      PatchAt patch_at, See see) {
  check(depth_mm.type() == CV_32F && depth_mm.cols == lens.width && depth_mm.rows == lens.height,
        "depth image is {}x{}, the lens {}x{}", depth_mm.cols, depth_mm.rows, lens.width,
        lens.height);
  const LensProjector projector(lens);
  const double middle = 0.5 * lens.height;
  const Rigid3 whole = camera.at(middle).inverse();  // of all rows of a global shutter
  // What is behind the camera at the first row, in the middle and at the last is so all the time.
  const std::array<Rigid3, 3> in_time = {camera.at(0.0).inverse(), whole,
                                         camera.at(lens.height).inverse()};
  const double cos_limit = std::cos(options_.max_incidence_rad);
  // Each triangle writes its own counters: the result does not depend on threads.
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, seen_.size(), 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      Rigid3 cam_from_world = whole;
                      Mat3 rotation = whole.rotation.toRotationMatrix();
                      for (std::size_t t = range.begin(); t < range.end(); ++t) {
                        const Patch patch = patch_at(t);
                        std::optional<Vec2> pixel;
                        if (camera.rolling()) {
                          if (std::ranges::none_of(in_time, [&](const Rigid3& pose) {
                                return (pose * patch.centre).z() > 0.0;
                              }))
                            continue;
                          pixel = camera.landing(
                              projector, [&](double) { return patch.centre; }, middle);
                          if (!pixel) continue;
                          cam_from_world = camera.at(pixel->y()).inverse();
                          rotation = cam_from_world.rotation.toRotationMatrix();
                        }
                        const Vec3 p_cam = rotation * patch.centre + cam_from_world.translation;
                        if (!(p_cam.z() > 0.0)) continue;
                        if (!camera.rolling()) pixel = projector.project(p_cam);
                        if (!pixel || !lens.contains(*pixel)) continue;
                        const float depth = depth_around(depth_mm, *pixel);
                        const double limit =
                            depth * (1.0 + options_.depth_margin_share) + options_.depth_margin_mm;
                        if (!(p_cam.z() <= limit)) continue;  // hidden, or nothing was hit there
                        ++seen_[t];
                        const double cos_incidence =
                            std::abs((rotation * patch.normal).dot(p_cam)) / p_cam.norm();
                        if (cos_incidence >= cos_limit) ++seen_well_[t];
                        see(t);
                      }
                    });
}

void Visibility::add(const Lens& lens, const RowPoses& camera, const cv::Mat& depth_mm) {
  look(
      lens, camera, depth_mm, [&](std::size_t t) { return at_rest_[t]; }, [](std::size_t) {});
}

void Visibility::add(const Lens& lens, const RowPoses& camera, const cv::Mat& depth_mm,
                     const TriangleMesh& moved) {
  check(moved.vertices.size() == wall_.vertices.size() &&
            moved.triangles.size() == wall_.triangles.size(),
        "the wall has {} vertices and {} triangles, the moved one {} and {}", wall_.vertices.size(),
        wall_.triangles.size(), moved.vertices.size(), moved.triangles.size());
  std::vector<char> seen_now(seen_.size(), 0);
  look(
      lens, camera, depth_mm, [&](std::size_t t) { return patch_of(moved, t); },
      [&](std::size_t t) { seen_now[t] = 1; });
  times_.resize(wall_.vertices.size(), 0);
  displacement_mm_.resize(wall_.vertices.size(), Vec3::Zero());
  std::vector<char> counted(wall_.vertices.size(), 0);
  for (std::size_t t = 0; t < seen_now.size(); ++t) {
    if (!seen_now[t]) continue;
    for (const int corner : wall_.triangles[t]) {
      const auto v = static_cast<std::size_t>(corner);
      if (counted[v]) continue;
      counted[v] = 1;
      ++times_[v];
      displacement_mm_[v] += moved.vertices[v] - wall_.vertices[v];
    }
  }
}

double Visibility::wall_area_mm2() const { return area_mm2(wall_); }

double Visibility::covered_area_mm2(std::uint32_t times) const {
  double area = 0.0;
  for (std::size_t t = 0; t < seen_well_.size(); ++t)
    if (seen_well_[t] >= times) area += triangle_area_mm2(wall_, t);
  return area;
}

TriangleMesh Visibility::seen_wall() const {
  TriangleMesh seen = wall_;
  seen.triangles.clear();
  for (std::size_t t = 0; t < seen_.size(); ++t)
    if (seen_[t] > 0) seen.triangles.push_back(wall_.triangles[t]);
  if (times_.empty()) return seen;
  seen.normals.clear();  // were those at rest
  for (std::size_t v = 0; v < times_.size(); ++v)
    if (times_[v] > 0) seen.vertices[v] += displacement_mm_[v] / times_[v];
  return seen;
}

}  // namespace rugae
