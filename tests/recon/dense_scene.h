#pragma once
// Walls with known depth under a light at the camera, drawn on the grid of depth maps.

#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "core/random.h"
#include "core/rigid3.h"
#include "recon/dense/depth_map.h"

namespace rugae::testing {

/// Distance along a unit ray, negative where it meets nothing, and the outward normal there.
struct DenseWall {
  std::function<double(const Vec3& origin, const Vec3& direction)> distance;
  std::function<Vec3(const Vec3& p)> normal;
};

inline DenseWall plane_wall(const Vec3& normal, double offset) {
  const Vec3 n = normal.normalized();
  return {[=](const Vec3& o, const Vec3& d) {
            const double t = (offset - n.dot(o)) / n.dot(d);
            return t > 0.0 ? t : -1.0;
          },
          [=](const Vec3&) { return n; }};
}

/// Seen from inside.
inline DenseWall sphere_wall(double radius) {
  return {[=](const Vec3& o, const Vec3& d) {
            const double b = o.dot(d);
            return -b + std::sqrt(b * b - o.squaredNorm() + radius * radius);
          },
          [](const Vec3& p) { return Vec3(p.normalized()); }};
}

/// Smooth mottling in space: waves of 2 to 8 of the length `unit`.
class Mottling {
 public:
  Mottling(std::uint64_t seed, double contrast, double unit = 1.0) : contrast_(contrast) {
    for (int i = 0; i < kWaves; ++i) {
      const auto u = random_uniform(seed, Purpose::test, 1, static_cast<std::uint64_t>(i));
      const double z = 2.0 * u[0] - 1.0, ring = std::sqrt(1.0 - z * z), a = 2.0 * kPi * u[1];
      const double length = unit * 2.0 * std::pow(4.0, u[2]);
      waves_.push_back(
          {2.0 * kPi / length * Vec3(ring * std::cos(a), ring * std::sin(a), z), 2.0 * kPi * u[3]});
    }
  }
  /// About 0.5, standard deviation 0.5 * contrast.
  double operator()(const Vec3& p) const {
    double sum = 0.0;
    for (const Wave& wave : waves_) sum += std::sin(wave.k.dot(p) + wave.phase);
    return 0.5 * (1.0 + contrast_ * sum * std::sqrt(2.0 / kWaves));
  }

 private:
  static constexpr int kWaves = 40;
  struct Wave {
    Vec3 k;
    double phase;
  };
  std::vector<Wave> waves_;
  double contrast_;
};

inline PinholeGrid small_grid() { return {160, 120, 80.0, 80.0, 80.0, 60.0}; }

/// z-depth, CV_32F; NaN where there is no wall.
inline cv::Mat true_depth(const DenseWall& wall, const Rigid3& cam_from_world,
                          const PinholeGrid& grid) {
  const Rigid3 world_from_cam = cam_from_world.inverse();
  cv::Mat depth(grid.size(), CV_32F);
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x) {
      const Vec3 ray = grid.ray(x, y);
      const double t =
          wall.distance(world_from_cam.translation, world_from_cam.rotation * ray.normalized());
      depth.at<float>(y, x) =
          t > 0.0 ? static_cast<float>(t / ray.norm()) : std::numeric_limits<float>::quiet_NaN();
    }
  return depth;
}

/// Levels are sRGB of light ~ albedo cos / d^2; `bright_at` is the distance of level 255 for a
/// white wall. White noise of `noise_levels`.
inline WideFrame draw_frame(const DenseWall& wall, const std::function<double(const Vec3&)>& albedo,
                            const Rigid3& cam_from_world, const PinholeGrid& grid, double bright_at,
                            double noise_levels, std::uint32_t frame) {
  const Rigid3 world_from_cam = cam_from_world.inverse();
  WideFrame picture{cv::Mat(grid.size(), CV_32FC3, cv::Scalar::all(0.0)),
                    cv::Mat(grid.size(), CV_8U, cv::Scalar(255))};
  for (int y = 0; y < grid.height; ++y)
    for (int x = 0; x < grid.width; ++x) {
      const Vec3 direction = world_from_cam.rotation * grid.ray(x, y).normalized();
      const double t = wall.distance(world_from_cam.translation, direction);
      if (!(t > 0.0)) {
        picture.known.at<uchar>(y, x) = 0;
        continue;
      }
      const Vec3 p = world_from_cam.translation + t * direction;
      const double light =
          albedo(p) * std::abs(wall.normal(p).dot(direction)) * (bright_at * bright_at) / (t * t);
      const double srgb =
          light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1.0 / 2.4) - 0.055;
      const double noise =
          noise_levels *
          random_normal(7, Purpose::test, frame, static_cast<std::uint64_t>(y) * 4096 + x)[0];
      picture.bgr.at<cv::Vec3f>(y, x) = cv::Vec3f::all(static_cast<float>(255.0 * srgb + noise));
    }
  return picture;
}

inline StereoView stereo_view(const WideFrame& frame, const Rigid3& cam_from_world,
                              const PinholeGrid& grid, const DenseOptions& options) {
  return {cam_from_world, stereo_levels(frame, grid, kStereoLevels, options.window_radius_px)};
}

/// A camera at `centre` that looks along `towards`.
inline Rigid3 looking(const Vec3& centre, const Vec3& towards) {
  const Quat world_from_cam = Quat::FromTwoVectors(Vec3::UnitZ(), towards.normalized());
  return Rigid3(world_from_cam, centre).inverse();
}

}  // namespace rugae::testing
