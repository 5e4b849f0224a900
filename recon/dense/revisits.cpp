#include "recon/dense/revisits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/in_lots.h"
#include "recon/dense/moving_keyframes.h"
#include "recon/dense/register_patch.h"
#include "recon/mask_at.h"
#include "recon/resection.h"
#include "recon/tracks.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;
// By which registration may move a track's observation, at 640 px width; a narrower picture's
// tracks are no more precise in pixels, so there as many.
constexpr double kMaxShiftPx = 1.5;
constexpr std::size_t kAtOnce = 16;  // key frames between two steps of the progress line
constexpr int kGroupGap = 8;         // key frames between the anchors of one group

// A patch seen in a key frame.
struct Seen {
  std::size_t patch;
  Vec2 pixel;
  int observation = -1;  // of the track, where it has one there
};

struct FrameResult {
  std::vector<Seen> registered, added;
  std::size_t foretold = 0, found = 0;
};

// Groups of `candidates`, which ascend by anchor: a gap between anchors begins another.
std::vector<std::pair<std::size_t, std::size_t>> groups_by_anchor(
    const std::vector<Seen>& candidates, const std::vector<WallPatch>& patches) {
  std::vector<std::pair<std::size_t, std::size_t>> groups;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= candidates.size(); ++i) {
    if (i < candidates.size() &&
        patches[candidates[i].patch].anchor - patches[candidates[i - 1].patch].anchor <= kGroupGap)
      continue;
    groups.emplace_back(begin, i);
    begin = i;
  }
  return groups;
}

// Those of the candidates that agree, group by group, on where the key frame stands.
std::vector<Seen> agreeing(const std::vector<Seen>& candidates,
                           const std::vector<WallPatch>& patches, const MovingPose& camera,
                           const RollingShutter& shutter, const BundleOptions& bundle) {
  std::vector<Seen> kept;
  for (const auto& [begin, end] : groups_by_anchor(candidates, patches)) {
    std::vector<Vec3> points;
    std::vector<Vec2> rays;
    std::vector<std::size_t> which;
    for (std::size_t i = begin; i < end; ++i) {
      const auto ray = ray_of(shutter.projector(), candidates[i].pixel);
      if (!ray) continue;
      const Vec3& point = patches[candidates[i].patch].centre;
      const double depth = (camera.cam_from_world * point).z();
      points.push_back(point);
      rays.push_back(shutter.ray_at_frame_time(*ray, depth, camera.motion));
      which.push_back(i);
    }
    const auto placement = place_by_points(points, rays, shutter.lens().fx, bundle);
    if (!placement) continue;
    for (std::size_t i = 0; i < which.size(); ++i)
      if (placement->inlier[i]) kept.push_back(candidates[which[i]]);
  }
  return kept;
}

// An observation of a patch's track.
struct Known {
  std::size_t patch;
  int observation;
};

// Those of each key frame.
std::vector<std::vector<Known>> known_observations(const Structure& structure,
                                                   const std::vector<WallPatch>& patches) {
  std::vector<std::vector<Known>> known(structure.frames.size());
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const Track& track = structure.tracks[static_cast<std::size_t>(patches[p].track)];
    for (std::size_t i = 0; i < track.observations.size(); ++i)
      known[static_cast<std::size_t>(track.observations[i].keyframe)].push_back(
          {p, static_cast<int>(i)});
  }
  return known;
}

FrameResult look_in(int keyframe, const CameraMotion& motion, const PatchImage& image,
                    const std::vector<WallPatch>& patches, const std::vector<Known>& known,
                    const PatchRegistrar& registrar, const RollingShutter& shutter,
                    const Structure& structure, const RevisitOptions& options,
                    const BundleOptions& bundle) {
  const double scale = shutter.lens().width / kReferenceWidthPx;
  const MovingPose camera{structure.cam_from_world[static_cast<std::size_t>(keyframe)], motion};
  std::vector<int> observation_of(patches.size(), -1);
  for (const Known& k : known) observation_of[k.patch] = k.observation;
  FrameResult result;
  std::vector<Seen> candidates;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const WallPatch& patch = patches[p];
    if (patch.anchor == keyframe) continue;
    const auto sight = foretell(patch, camera, shutter);
    if (!sight) continue;
    if (observation_of[p] >= 0) {
      const Vec2 start = structure.tracks[static_cast<std::size_t>(patch.track)]
                             .observations[static_cast<std::size_t>(observation_of[p])]
                             .pixel;
      const auto pixel = registrar.settle(patch, *sight, image, start);
      if (pixel && (*pixel - start).norm() <= kMaxShiftPx * std::max(1.0, scale))
        result.registered.push_back({p, *pixel, observation_of[p]});
      continue;
    }
    if (!mask_at(image.usable, sight->pixel)) continue;
    ++result.foretold;
    const auto pixel = registrar.find(patch, *sight, image, options.search_px * scale);
    if (pixel) candidates.push_back({p, *pixel});
  }
  result.found = candidates.size();
  result.added = agreeing(candidates, patches, camera, shutter, bundle);
  return result;
}

}  // namespace

RevisitReport observe_again(const FrameSource& frames, const std::vector<WallPatch>& patches,
                            const RevisitOptions& options, const BundleOptions& bundle,
                            Structure& structure, Progress& progress) {
  const std::size_t n = structure.frames.size();
  const auto known = known_observations(structure, patches);
  const PatchRegistrar registrar(frames.lens());
  const std::vector<CameraMotion> motions = keyframe_motions(frames, structure);
  std::vector<FrameResult> results(n);
  do_in_lots(n, kAtOnce, progress, [&](std::size_t k) {
    if (!structure.placed[k]) return;
    const PatchImage image = prepare_patch_image(frames.pose_frame(structure.frames[k]));
    results[k] = look_in(static_cast<int>(k), motions[k], image, patches, known[k], registrar,
                         frames.shutter(), structure, options, bundle);
  });
  RevisitReport report;
  report.patches = patches.size();
  for (std::size_t k = 0; k < n; ++k) {
    const auto track_of = [&](const Seen& seen) -> Track& {
      return structure.tracks[static_cast<std::size_t>(patches[seen.patch].track)];
    };
    report.foretold += results[k].foretold;
    report.found += results[k].found;
    report.accepted += results[k].added.size();
    report.registered += results[k].registered.size();
    for (const Seen& seen : results[k].registered) {
      Track::Observation& o =
          track_of(seen).observations[static_cast<std::size_t>(seen.observation)];
      o.pixel = seen.pixel;
    }
    for (const Seen& seen : results[k].added)
      track_of(seen).observations.push_back({static_cast<int>(k), seen.pixel});
  }
  for (Track& track : structure.tracks)
    std::ranges::stable_sort(track.observations, {}, &Track::Observation::keyframe);
  return report;
}

void link_revisits(const FrameSource& frames, const RevisitOptions& options,
                   const BundleOptions& bundle, Structure& structure, Progress& progress) {
  if (frames.shutter().rolling())
    finish_moving(frames, bundle, kDraftAdjustment, structure, progress);
  for (int round = 0; round < options.rounds; ++round) {
    progress.begin("revisits", structure.frames.size());
    const std::vector<WallPatch> patches = make_patches(frames, structure);
    const RevisitReport report =
        observe_again(frames, patches, options, bundle, structure, progress);
    progress.end(fmt::format(
        "{} patches, {} sights registered, {} looked for, {} found, {} accepted", report.patches,
        report.registered, report.foretold, report.found, report.accepted));
    finish_moving(frames, bundle, round + 1 < options.rounds ? kDraftAdjustment : kFinalAdjustment,
                  structure, progress);
  }
}

}  // namespace rugae
