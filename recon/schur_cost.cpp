#include "recon/schur_cost.h"

#include <limits>

namespace rugae {

std::vector<SchurCamera> cameras_of(const std::vector<Rigid3>& cam_from_world) {
  std::vector<SchurCamera> cameras;
  cameras.reserve(cam_from_world.size());
  for (const Rigid3& pose : cam_from_world)
    cameras.push_back({pose.rotation.toRotationMatrix(), pose.translation});
  return cameras;
}

double cost_of(const SchurProblem& problem, const std::vector<SchurCamera>& cameras,
               const std::vector<Vec3>& positions, const PointParts& parts) {
  std::vector<double> sums(parts.count, 0.0);
  parts.each([&](std::size_t part) {
    double sum = 0.0;
    for (std::size_t i = parts.begin(part); i < parts.begin(part + 1); ++i) {
      for (const SchurProblem::Observation& o : problem.points[i].observations) {
        const SchurCamera& camera = cameras[o.camera];
        const Vec3 p = camera.rotation * positions[i] + camera.translation;
        if (!(p.z() > kSchurMinDepth)) {
          sums[part] = std::numeric_limits<double>::infinity();
          return;
        }
        const Vec2 r = problem.focal_px * (p.head<2>() / p.z() - o.ray);
        sum += huber(r.squaredNorm(), problem.huber_px).value;
      }
    }
    sums[part] = sum;
  });
  double cost = 0.0;
  for (const double sum : sums) cost += 0.5 * sum;
  return cost;
}

}  // namespace rugae
