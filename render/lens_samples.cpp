#include "render/lens_samples.h"

#include <array>
#include <cmath>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/random.h"

namespace rugae {
namespace {

constexpr int kStepsAStratum = 8;

// Direction numbers of a dimension: v_i = m_i 2^(32 - i), m by the recurrence of a primitive
// polynomial of degree s with inner coefficients a.
using Directions = std::array<std::uint32_t, 32>;
Directions directions(int s, std::uint32_t a, std::array<std::uint32_t, 3> m) {
  Directions v{};
  for (int i = 0; i < 32; ++i) {
    if (i < s) {
      v[i] = m[i] << (31 - i);
      continue;
    }
    v[i] = v[i - s] ^ (v[i - s] >> s);
    for (int k = 1; k < s; ++k)
      if ((a >> (s - 1 - k)) & 1u) v[i] ^= v[i - k];
  }
  return v;
}

std::uint32_t sobol(std::uint32_t k, int dimension) {
  static const std::array<Directions, 4> kDirections = {
      directions(1, 0, {1}), directions(2, 1, {1, 3}), directions(3, 1, {1, 3, 1}),
      directions(3, 2, {1, 1, 1})};
  std::uint32_t x = 0;
  for (int i = 0; k != 0; k >>= 1, ++i)
    if (k & 1u) x ^= kDirections[dimension][i];
  return x;
}

// Change of the ray per pixel at place `at` of a row or column of `size`, `stride` being the way to
// the next; zero where the lens sees nothing beside it.
Vec3 slope(const RayTable& rays, int pixel, int at, int size, int stride) {
  const int low = at > 0 ? 1 : 0, high = at + 1 < size ? 1 : 0;
  const Vec3& a = rays.directions_cam[static_cast<std::size_t>(pixel - low * stride)];
  const Vec3& b = rays.directions_cam[static_cast<std::size_t>(pixel + high * stride)];
  if (low + high == 0 || a.isZero(0.0) || b.isZero(0.0)) return Vec3::Zero();
  return (b - a) / (low + high);
}

}  // namespace

LensSampler::LensSampler(const RayTable& rays, const FrameView& view, const LensSampling& sampling)
    : rays_(rays),
      sampling_(sampling),
      instants_a_row_(sampling.exposure_s > 0.0 ? kStepsAStratum * sampling.samples : 1),
      rows_alike_(!view.camera.rolling()) {
  check(sampling.samples >= 1, "lens samples: {} a pixel, expected at least 1", sampling.samples);
  if (!(sampling.exposure_s > 0.0)) {
    instants_ = view.instants(rays.height);
    return;
  }
  check(static_cast<bool>(view.pose_at), "lens samples: an exposure needs the camera's path");
  const int rows = rows_alike_ ? 1 : rays.height;
  instants_.reserve(static_cast<std::size_t>(rows) * instants_a_row_);
  for (int y = 0; y < rows; ++y) {
    const double middle_s = view.camera.offset_s(y + 0.5);
    for (int i = 0; i < instants_a_row_; ++i) {
      const double offset_s = middle_s + ((i + 0.5) / instants_a_row_ - 0.5) * sampling.exposure_s;
      const Rigid3 pose = view.pose_at(offset_s);
      instants_.push_back(
          {pose.rotation.toRotationMatrix(), pose.translation, view.beat(offset_s)});
    }
  }
}

void LensSampler::begin(int x0, int y0, Tile& tile, Pixels& pixels) const {
  place_pixels(rays_, x0, y0, tile);
  tile.instants = instants_;
  tile.one_eye = instants_.size() == 1 && !(sampling_.aperture_radius_mm > 0.0);
  for (int lane = 0; lane < tile.count; ++lane) {
    const int pixel = tile.pixel[lane];
    pixels.shift[lane] = random_words(sampling_.seed, Purpose::lens_samples, sampling_.frame,
                                      static_cast<std::uint64_t>(pixel));
    pixels.to_right[lane] = slope(rays_, pixel, tile.column[lane], rays_.width, 1);
    pixels.down[lane] = slope(rays_, pixel, tile.row[lane], rays_.height, rays_.width);
  }
}

void LensSampler::place(int k, const Pixels& pixels, Tile& tile) const {
  std::array<std::uint32_t, 4> point;
  for (int d = 0; d < 4; ++d) point[d] = sobol(static_cast<std::uint32_t>(k), d);
  for (int lane = 0; lane < tile.count; ++lane) {
    const int pixel = tile.pixel[lane];
    const auto& shift = pixels.shift[lane];
    const auto at = [&](int d) { return uniform01(point[d] ^ shift[d]); };
    int instant = rows_alike_ ? 0 : tile.row[lane] * instants_a_row_;
    if (instants_a_row_ > 1) {
      const auto late = random_uniform(sampling_.seed, Purpose::lens_samples, sampling_.frame,
                                       static_cast<std::uint64_t>(pixel) | (1ull << 40));
      instant += k * kStepsAStratum + static_cast<int>(late[0] * kStepsAStratum);
    }
    tile.instant[lane] = instant;
    const Instant& moment = instants_[static_cast<std::size_t>(instant)];
    // Zero where the lens sees nothing.
    Vec3 ray = rays_.directions_cam[static_cast<std::size_t>(pixel)];
    if (!ray.isZero(0.0)) {
      ray += (at(0) - 0.5) * pixels.to_right[lane] + (at(1) - 0.5) * pixels.down[lane];
      ray /= std::sqrt(ray.squaredNorm());
    }
    Vec3 start_cam = Vec3::Zero(), direction_cam = ray;
    if (sampling_.aperture_radius_mm > 0.0 && ray.z() > 0.0) {
      const double radius_mm = sampling_.aperture_radius_mm * std::sqrt(at(2));
      const SineCosine turn = portable_turn(at(3));
      start_cam = {radius_mm * turn.cosine, radius_mm * turn.sine, 0.0};
      direction_cam = ray * (sampling_.focus_distance_mm / ray.z()) - start_cam;
      direction_cam /= std::sqrt(direction_cam.squaredNorm());
    }
    tile.eye[lane] = {moment.camera_mm + moment.world_from_camera * start_cam, moment.beat};
    tile.direction_world[lane] = moment.world_from_camera * direction_cam;
  }
}

}  // namespace rugae
