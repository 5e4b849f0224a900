#include "recon/dense/frame_poses.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/in_lots.h"
#include "recon/dense/moving_keyframes.h"
#include "recon/dense/place_by_patches.h"
#include "recon/frames_between.h"

namespace rugae {
namespace {

constexpr double kSearchPx = 16.0;         // around where a patch should be, at 640 px width
constexpr std::size_t kMostPatches = 300;  // looked for: more adds time and no precision
constexpr int kFramesAtOnce = 16;          // between two steps of the progress line

// Patches seen by any of the key frames, at most kMostPatches, spread over the list.
std::vector<const WallPatch*> seen_by(const std::vector<int>& keyframes,
                                      const std::vector<std::vector<int>>& patches_of,
                                      const std::vector<WallPatch>& patches) {
  std::vector<int> indices;
  for (const int k : keyframes)
    indices.insert(indices.end(), patches_of[k].begin(), patches_of[k].end());
  std::ranges::sort(indices);
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  const std::size_t stride = 1 + indices.size() / kMostPatches;
  std::vector<const WallPatch*> chosen;
  for (std::size_t i = 0; i < indices.size(); i += stride)
    chosen.push_back(&patches[static_cast<std::size_t>(indices[i])]);
  return chosen;
}

}  // namespace

std::vector<std::optional<Rigid3>> place_frames(const FrameSource& frames,
                                                const Structure& structure,
                                                const std::vector<WallPatch>& patches,
                                                const BundleOptions& options, Progress& progress) {
  const int n = frames.size();
  std::vector<std::optional<Rigid3>> poses = keyframe_poses(structure, n);
  const std::vector<int> rest = without_pose(poses), placed = placed_keyframes(structure);
  progress.begin("frames between", rest.size() * (frames.shutter().rolling() ? 2 : 1));
  if (placed.empty()) {
    progress.end("nothing to place frames in");
    return poses;
  }
  std::vector<int> patch_of(structure.tracks.size(), -1);
  for (std::size_t p = 0; p < patches.size(); ++p)
    patch_of[static_cast<std::size_t>(patches[p].track)] = static_cast<int>(p);
  std::vector<std::vector<int>> patches_of(structure.frames.size());
  for (std::size_t t = 0; t < structure.tracks.size(); ++t)
    for (const auto& o : structure.tracks[t].observations)
      if (patch_of[t] >= 0) patches_of[o.keyframe].push_back(patch_of[t]);

  const PatchRegistrar registrar(frames.lens());
  const RollingShutter& shutter = frames.shutter();
  const cv::Mat none = cv::Mat::zeros(frames.valid().size(), CV_8U);
  const auto place_all = [&](const std::vector<int>& which, Progress& shown,
                             const auto& guesses_of) {
    do_in_lots(which.size(), kFramesAtOnce, shown, [&](std::size_t i) {
      const int f = which[i];
      const PatchImage image = prepare_patch_image({f, frames.gray(f), {}, none, frames.valid()});
      const Between around = between(structure, placed, f);
      const auto seen = seen_by(around.keyframes, patches_of, patches);
      for (const MovingPose& guess : guesses_of(f, around)) {
        const auto placed =
            place_by_patches(seen, image, guess, registrar, shutter, kSearchPx, options);
        if (!placed) continue;
        poses[f] = placed->cam_from_world;
        break;
      }
    });
  };
  const std::vector<CameraMotion> motions = keyframe_motions(frames, structure);
  place_all(rest, progress, [&](int, const Between& around) {
    const CameraMotion& motion = motions[around.keyframes.front()];  // of the nearer one
    std::vector<MovingPose> guesses;
    if (around.cam_from_world) guesses.push_back({*around.cam_from_world, motion});
    if (around.beyond) guesses.push_back({*around.beyond, motion});
    for (const int k : around.keyframes)
      guesses.push_back({structure.cam_from_world[k], motions[k]});
    return guesses;
  });
  if (shutter.rolling()) {  // how the camera moves is known from the frames next to each now
    const std::vector<CameraMotion> known = motions_of(poses, frames.observations().times_s());
    place_all(rest, progress, [&](int f, const Between&) {
      return poses[f] ? std::vector<MovingPose>{{*poses[f], known[f]}} : std::vector<MovingPose>{};
    });
  }
  // Where the pace is uneven between two key frames, the frames that were placed lead to the
  // others.
  Progress unshown(Progress::Output::silent);  // how many rounds of them is not known
  for (bool more = true; more;) {
    more = false;
    const std::vector<std::optional<Rigid3>> known = poses;
    std::vector<int> missing = without_pose(known);
    std::erase_if(missing, [&](int f) {  // farther from all that are placed: not yet
      return !(f > 0 && known[f - 1]) && !(f + 1 < n && known[f + 1]);
    });
    const std::vector<CameraMotion> moves = motions_of(known, frames.observations().times_s());
    place_all(missing, unshown, [&](int f, const Between& around) {
      const CameraMotion& motion = moves[structure.frames[around.keyframes.front()]];
      std::vector<MovingPose> guesses;
      for (const Rigid3& place : beside_frames(known, f)) guesses.push_back({place, motion});
      return guesses;
    });
    for (const int f : missing) more = more || poses[f].has_value();
  }
  const auto lost = std::ranges::count_if(poses, [](const auto& pose) { return !pose; });
  progress.end(fmt::format("{} of {} frames placed, {} lost", n - lost, n, lost));
  return poses;
}

}  // namespace rugae
