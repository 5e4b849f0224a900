#include "validate/align.h"

#include <cmath>

#include "core/check.h"

namespace rugae {
namespace {

bool finite(const Rigid3& pose) {
  return pose.translation.allFinite() && pose.rotation.coeffs().allFinite();
}

}  // namespace

TrackPair associate(const PoseTrack& truth, const PoseTrack& estimate) {
  for (const TimedPose& pose : truth)
    check(finite(pose.world_from_camera), "true pose at {} s is not finite", pose.time_s);
  TrackPair pair;
  for (const TimedPose& pose : estimate) {
    check(finite(pose.world_from_camera), "estimated pose at {} s is not finite", pose.time_s);
    const std::optional<Rigid3> true_pose = interpolate(truth, pose.time_s);
    if (!true_pose) continue;
    pair.time_s.push_back(pose.time_s);
    pair.truth.push_back(*true_pose);
    pair.estimate.push_back(pose.world_from_camera);
  }
  return pair;
}

std::optional<Sim3> align_tracks(const TrackPair& pair, Alignment alignment) {
  std::vector<Vec3> source, target;
  for (std::size_t i = 0; i < pair.size(); ++i) {
    source.push_back(pair.estimate[i].translation);
    target.push_back(pair.truth[i].translation);
  }
  return umeyama(source, target, alignment == Alignment::sim3);
}

TriangleMesh transformed(const TriangleMesh& mesh, const Sim3& target_from_mesh) {
  TriangleMesh moved = mesh;
  for (Vec3& vertex : moved.vertices) vertex = target_from_mesh * vertex;
  for (float& sigma : moved.sigma) sigma *= static_cast<float>(target_from_mesh.scale);
  const Eigen::Quaternionf turn = target_from_mesh.rotation.cast<float>();
  for (Vec3f& normal : moved.normals) normal = turn * normal;
  return moved;
}

}  // namespace rugae
