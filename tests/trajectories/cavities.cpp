#include "tests/trajectories/cavities.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/units.h"

namespace rugae {
namespace {

/// A surface of rings between two poles: ring(i, angle) for i in [1, rings - 1], poles at 0 and
/// `rings`.
TriangleMesh rings_and_poles(int rings, int around,
                             const std::function<Vec3(int ring, double angle)>& point) {
  TriangleMesh mesh;
  mesh.vertices.push_back(point(0, 0.0));
  for (int i = 1; i < rings; ++i)
    for (int k = 0; k < around; ++k) mesh.vertices.push_back(point(i, 2.0 * kPi * k / around));
  mesh.vertices.push_back(point(rings, 0.0));
  const int last = static_cast<int>(mesh.vertices.size()) - 1;
  const auto at = [&](int ring, int k) { return 1 + (ring - 1) * around + k % around; };
  for (int k = 0; k < around; ++k) {
    mesh.triangles.emplace_back(0, at(1, k + 1), at(1, k));
    for (int i = 1; i + 1 < rings; ++i) {
      mesh.triangles.emplace_back(at(i, k), at(i, k + 1), at(i + 1, k));
      mesh.triangles.emplace_back(at(i, k + 1), at(i + 1, k + 1), at(i + 1, k));
    }
    mesh.triangles.emplace_back(last, at(rings - 1, k), at(rings - 1, k + 1));
  }
  if (signed_volume_mm3(mesh) < 0.0)
    for (Vec3i& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

}  // namespace

TriangleMesh ellipsoid(const Vec3& semi_axes_mm, const Vec3& center_mm) {
  constexpr int kRings = 32, kAround = 48;
  return rings_and_poles(kRings, kAround, [&](int ring, double angle) {
    const double polar = kPi * ring / kRings;
    const Vec3 unit(std::cos(polar), std::sin(polar) * std::cos(angle),
                    std::sin(polar) * std::sin(angle));
    return Vec3(center_mm + semi_axes_mm.cwiseProduct(unit));
  });
}

TriangleMesh bent_tube(double tube_radius_mm, double arc_radius_mm, double arc_rad) {
  constexpr int kCap = 10, kBody = 28, kAround = 40;
  return rings_and_poles(2 * kCap + kBody, kAround, [&](int ring, double angle) {
    // Along the arc, and beyond its ends along the half spheres.
    double arc = 0.0, beyond = 0.0;
    if (ring < kCap) {
      beyond = 0.5 * kPi * (ring - kCap) / kCap;
    } else if (ring > kCap + kBody) {
      beyond = 0.5 * kPi * (ring - kCap - kBody) / kCap;
      arc = arc_rad;
    } else {
      arc = arc_rad * (ring - kCap) / kBody;
    }
    const Vec3 outward(std::cos(arc), std::sin(arc), 0.0), along(-outward.y(), outward.x(), 0.0);
    const Vec3 beside = std::cos(angle) * outward + std::sin(angle) * Vec3::UnitZ();
    return Vec3(arc_radius_mm * outward +
                tube_radius_mm * (std::cos(beyond) * beside + std::sin(beyond) * along));
  });
}

TriangleMesh test_ellipsoid() { return ellipsoid({60.0, 48.0, 45.0}, {10.0, -20.0, 30.0}); }
TriangleMesh test_tube() { return bent_tube(32.0, 75.0, rad_from_deg(110.0)); }

double view_distance_mm(const ClosestPoint& wall, const Rigid3& world_from_camera) {
  constexpr double kHitMm = 0.02;
  constexpr int kMaxSteps = 1000;
  const Vec3 axis = world_from_camera.rotation * Vec3::UnitZ();
  double t = 0.0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double room = -wall.signed_distance_mm(world_from_camera.translation + t * axis);
    if (!(room > kHitMm)) break;
    t += room;
  }
  return t;
}

PathMotion motion_of(const PoseTrack& track) {
  PathMotion motion;
  for (std::size_t i = 1; i < track.size(); ++i) {
    const Rigid3 &a = track[i - 1].world_from_camera, &b = track[i].world_from_camera;
    const double mm = (b.translation - a.translation).norm();
    const double deg = deg_from_rad(angle_between_rad(a.rotation, b.rotation));
    motion.mean_mm += mm / (track.size() - 1.0);
    motion.mean_deg += deg / (track.size() - 1.0);
    motion.max_mm = std::max(motion.max_mm, mm);
    motion.max_deg = std::max(motion.max_deg, deg);
  }
  return motion;
}

int revisits(const PoseTrack& track, double apart_mm, double near_mm, double similar_deg) {
  std::vector<double> way(track.size(), 0.0);
  for (std::size_t i = 1; i < track.size(); ++i)
    way[i] = way[i - 1] +
             (track[i].world_from_camera.translation - track[i - 1].world_from_camera.translation)
                 .norm();
  int pairs = 0;
  for (std::size_t i = 0; i < track.size(); ++i)
    for (std::size_t j = i + 1; j < track.size(); ++j) {
      const Rigid3 &a = track[i].world_from_camera, &b = track[j].world_from_camera;
      pairs += way[j] - way[i] > apart_mm && (a.translation - b.translation).norm() < near_mm &&
               angle_between_rad(a.rotation, b.rotation) < rad_from_deg(similar_deg);
    }
  return pairs;
}

}  // namespace rugae
