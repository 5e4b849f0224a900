// Writes the dataset of a plane known in closed form, and an estimate that is right up to a
// similarity.
#include "tests/dataset/plane_dataset.h"

#include "dataset/estimate.h"
#include "dataset/image_io.h"

int main(int count, char** arguments) {
  if (count != 3) return 2;
  const rugae::testing::PlaneWorld world(6);
  world.write(arguments[1]);
  rugae::Estimate estimate;
  estimate.method = "test";
  estimate.lens = world.camera.lens;
  // map = 0.5 R world + t
  const rugae::Quat rotation(Eigen::AngleAxisd(0.7, rugae::Vec3(1, 2, 3).normalized()));
  const rugae::Vec3 translation(4.0, -5.0, 6.0);
  for (const auto& pose : world.track) {
    estimate.times_s.push_back(pose.time_s);
    estimate.states.push_back(rugae::FrameState::keyframe);
    estimate.world_from_camera.emplace_back(
        rotation * pose.world_from_camera.rotation,
        0.5 * (rotation * pose.world_from_camera.translation) + translation);
  }
  estimate.states[2] = rugae::FrameState::lost;
  estimate.map = world.wall();
  for (rugae::Vec3& v : estimate.map.vertices) v = 0.5 * (rotation * v) + translation;
  estimate.points = estimate.map.vertices;
  estimate.numbers["keyframes"] = 5;
  rugae::write_estimate(arguments[2], estimate);
  const rugae::EstimateLayout layout{arguments[2]};
  std::filesystem::create_directories(layout.depth_folder());
  rugae::write_exr(layout.depth(1), cv::Mat(0.5 * world.truth(1).depth_mm));
  return 0;
}
