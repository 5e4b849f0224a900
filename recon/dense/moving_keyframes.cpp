#include "recon/dense/moving_keyframes.h"

#include "recon/tracks.h"

namespace rugae {
namespace {

constexpr int kRollingRounds = 2;  // of rays and poses in turn

}  // namespace

std::vector<CameraMotion> keyframe_motions(const FrameSource& frames, const Structure& structure) {
  std::vector<std::optional<Rigid3>> poses(structure.frames.size());
  std::vector<double> times_s;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (structure.placed[k]) poses[k] = structure.cam_from_world[k];
    times_s.push_back(frames.observations().time_s(structure.frames[k]));
  }
  return motions_of(poses, times_s);
}

void set_rays_at_frame_time(const FrameSource& frames, Structure& structure) {
  set_rays(structure.tracks, frames.lens());
  if (!frames.shutter().rolling()) return;
  const std::vector<CameraMotion> motions = keyframe_motions(frames, structure);
  for (Track& track : structure.tracks)
    for (Track::Observation& o : track.observations) {
      const double depth = (structure.cam_from_world[o.keyframe] * track.point).z();
      o.ray = frames.shutter().ray_at_frame_time(o.ray, depth, motions[o.keyframe]);
    }
}

void finish_moving(const FrameSource& frames, const BundleOptions& options,
                   const Adjustment& adjustment, Structure& structure, Progress& progress) {
  const int rounds = frames.shutter().rolling() ? kRollingRounds : 1;
  for (int round = 0; round < rounds; ++round) {
    set_rays_at_frame_time(frames, structure);
    finish_structure(structure, frames.lens(), options, adjustment, progress);
  }
}

}  // namespace rugae
