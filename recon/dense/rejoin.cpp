#include "recon/dense/rejoin.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/spread.h"
#include "recon/dense/moving_keyframes.h"
#include "recon/dense/place_by_patches.h"

namespace rugae {
namespace {

constexpr int kLookedAt = 16;      // key frames from a break on, until one is found
constexpr int kRings = 3;          // of turned guesses around the foretold one
constexpr double kRingRad = 0.05;  // between them; the search for patches covers as much
constexpr int kPatches = 600;      // looked for in a key frame: few may be found from so far
constexpr int kPlacedAtMost = 24;  // key frames that the similarity is fitted to
constexpr int kMinPlaced = 3;
// Poses agree as far as the search for revisits, a few degrees, covers what is left.
constexpr double kMinAgreeing = 0.75;   // of those placed
constexpr double kAgreeingRad = 0.1;    // orientation
constexpr double kAgreeingShare = 0.1;  // position, of the distance of what is seen

// Neighbours along the path, one placed in the map and one in the segment.
struct Break {
  int of_map = -1, of_segment = -1;
};

std::vector<Break> breaks_between(const Structure& map, const Structure& segment) {
  std::vector<Break> breaks;
  int before = -1;
  for (int k = 0; k < static_cast<int>(map.frames.size()); ++k) {
    if (!map.placed[k] && !segment.placed[k]) continue;
    if (before >= 0 && map.placed[before] && segment.placed[k]) breaks.push_back({before, k});
    if (before >= 0 && segment.placed[before] && map.placed[k]) breaks.push_back({k, before});
    before = k;
  }
  return breaks;
}

// The similarity that takes a camera of the segment to where it stands in the map.
Sim3 carried(const Rigid3& cam_from_map, const Rigid3& cam_from_segment, double scale) {
  const Rigid3 map_from_cam = cam_from_map.inverse();
  return {
      scale, (map_from_cam.rotation * cam_from_segment.rotation).normalized(),
      map_from_cam.rotation * (scale * cam_from_segment.translation) + map_from_cam.translation};
}

// A key frame of the segment that was found in the map.
struct Found {
  int keyframe = -1;
  Rigid3 cam_from_map;
};

class Finder {
 public:
  Finder(const FrameSource& frames, const Structure& map, const std::vector<WallPatch>& patches,
         const Structure& segment, const RevisitOptions& options, const BundleOptions& bundle)
      : frames_(frames),
        map_(map),
        segment_(segment),
        options_(options),
        bundle_(bundle),
        patches_(patches),
        map_motions_(keyframe_motions(frames, map)),
        segment_motions_(keyframe_motions(frames, segment)),
        registrar_(frames.lens()) {
    for (int k = 0; k < static_cast<int>(segment.frames.size()); ++k)
      if (segment.placed[k]) keyframes_.push_back(k);
  }

  std::optional<Sim3> find(const Break& at) const {
    const auto guess = foretold(at);
    if (!guess) return std::nullopt;
    const auto first = look_around(*guess, nearest(at.of_segment, kLookedAt));
    if (!first) return std::nullopt;
    std::vector<Found> found{*first};
    Sim3 map_from_segment = carried(first->cam_from_map, pose_of(*first), guess->scale);
    for (const int k : nearest(first->keyframe, kPlacedAtMost)) {
      if (k == first->keyframe) continue;
      const auto placed = place(image_of(k), k, map_from_segment, Quat::Identity());
      if (!placed) continue;
      found.push_back({k, placed->cam_from_world});
      if (found.size() >= kMinPlaced) map_from_segment = fitted(found, map_from_segment.scale);
    }
    if (found.size() < kMinPlaced) return std::nullopt;
    const auto agreeing =
        std::ranges::count_if(found, [&](const Found& f) { return agrees(f, map_from_segment); });
    if (static_cast<double>(agreeing) < kMinAgreeing * static_cast<double>(found.size()))
      return std::nullopt;
    return map_from_segment;
  }

 private:
  const Rigid3& pose_of(const Found& f) const { return segment_.cam_from_world[f.keyframe]; }

  // Where the segment lies if the camera went on as it moved on both sides of the break.
  std::optional<Sim3> foretold(const Break& at) const {
    const CameraMotion &in_map = map_motions_[at.of_map],
                       &in_segment = segment_motions_[at.of_segment];
    const double scale = in_map.shift_per_s.norm() / in_segment.shift_per_s.norm();
    if (!(scale > 0.0) || !std::isfinite(scale)) return std::nullopt;
    const CameraMotion mean{0.5 * (in_map.turn_rad_per_s + in_segment.turn_rad_per_s),
                            0.5 * (in_map.shift_per_s + scale * in_segment.shift_per_s)};
    const double dt_s = frames_.observations().time_s(segment_.frames[at.of_segment]) -
                        frames_.observations().time_s(map_.frames[at.of_map]);
    const Rigid3 cam_from_map = mean.after(dt_s) * map_.cam_from_world[at.of_map];
    return carried(cam_from_map, segment_.cam_from_world[at.of_segment], scale);
  }

  // Key frames of the segment, the nearest to `keyframe` first.
  std::vector<int> nearest(int keyframe, int count) const {
    std::vector<int> order = keyframes_;
    std::ranges::stable_sort(order, {}, [&](int k) { return std::abs(k - keyframe); });
    if (static_cast<int>(order.size()) > count) order.resize(static_cast<std::size_t>(count));
    return order;
  }

  PatchImage image_of(int k) const {
    return prepare_patch_image(frames_.pose_frame(segment_.frames[k]));
  }

  // From where the similarity has the key frame, turned.
  std::optional<Placement> place(const PatchImage& image, int k, const Sim3& map_from_segment,
                                 const Quat& turn) const {
    const Rigid3 pose = (map_from_segment * segment_.cam_from_world[k].inverse()).inverse();
    const CameraMotion& motion = segment_motions_[k];
    const MovingPose guess{{turn * pose.rotation, turn * pose.translation},
                           {motion.turn_rad_per_s, map_from_segment.scale * motion.shift_per_s}};
    std::vector<const WallPatch*> seen;
    for (const WallPatch& patch : patches_)
      if (foretell(patch, guess, frames_.shutter())) seen.push_back(&patch);
    std::vector<const WallPatch*> chosen;
    for (const int i : spread(static_cast<int>(seen.size()), kPatches))
      chosen.push_back(seen[static_cast<std::size_t>(i)]);
    return place_by_patches(chosen, image, guess, registrar_, frames_.shutter(), options_.search_px,
                            bundle_);
  }

  // The first of the key frames that is found by guesses turned this way and that; of the guesses
  // of a ring the one that most patches agree on.
  std::optional<Found> look_around(const Sim3& guess, const std::vector<int>& keyframes) const {
    for (const int k : keyframes) {
      const PatchImage image = image_of(k);
      for (int ring = 0; ring <= kRings; ++ring) {
        std::vector<Quat> turns;
        for (int x = -ring; x <= ring; ++x)
          for (int y = -ring; y <= ring; ++y)
            if (std::max(std::abs(x), std::abs(y)) == ring)
              turns.push_back(Quat(Eigen::AngleAxisd(kRingRad * x, Vec3::UnitX()) *
                                   Eigen::AngleAxisd(kRingRad * y, Vec3::UnitY())));
        std::vector<std::optional<Placement>> placed(turns.size());
        tbb::parallel_for(std::size_t{0}, turns.size(),
                          [&](std::size_t i) { placed[i] = place(image, k, guess, turns[i]); });
        const auto best =
            std::ranges::max_element(placed, {}, [](const auto& p) { return p ? p->inliers : 0; });
        if (*best) return Found{k, (*best)->cam_from_world};
      }
    }
    return std::nullopt;
  }

  // Mean rotation; scale and shift by least squares of the camera centres. Cameras in one place
  // tell no scale: then it is what it was.
  Sim3 fitted(const std::vector<Found>& found, double scale) const {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    Vec3 centre_map = Vec3::Zero(), centre_segment = Vec3::Zero();
    for (const Found& f : found) {
      const Quat q = f.cam_from_map.rotation.conjugate() * pose_of(f).rotation;
      sum += sum.dot(q.coeffs()) < 0.0 ? Eigen::Vector4d(-q.coeffs()) : q.coeffs();
      centre_map += f.cam_from_map.inverse().translation;
      centre_segment += pose_of(f).inverse().translation;
    }
    const double n = static_cast<double>(found.size());
    centre_map /= n;
    centre_segment /= n;
    const Quat rotation(sum.normalized());
    double along = 0.0, square = 0.0;
    for (const Found& f : found) {
      const Vec3 there = f.cam_from_map.inverse().translation - centre_map;
      const Vec3 here = rotation * (pose_of(f).inverse().translation - centre_segment);
      along += there.dot(here);
      square += here.squaredNorm();
    }
    if (along > 0.0 && square > 0.0) scale = along / square;
    return {scale, rotation, centre_map - scale * (rotation * centre_segment)};
  }

  bool agrees(const Found& f, const Sim3& map_from_segment) const {
    const Rigid3 here = map_from_segment * pose_of(f).inverse(), there = f.cam_from_map.inverse();
    std::vector<double> depths;
    for (const Track& track : segment_.tracks)
      for (const Track::Observation& o : track.observations)
        if (o.keyframe == f.keyframe) depths.push_back((pose_of(f) * track.point).z());
    if (depths.empty()) return false;
    const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::ranges::nth_element(depths, middle);
    return angle_between_rad(here.rotation, there.rotation) <= kAgreeingRad &&
           (here.translation - there.translation).norm() <=
               kAgreeingShare * map_from_segment.scale * *middle;
  }

  const FrameSource& frames_;
  const Structure &map_, &segment_;
  const RevisitOptions& options_;
  const BundleOptions& bundle_;
  const std::vector<WallPatch>& patches_;
  std::vector<CameraMotion> map_motions_, segment_motions_;
  PatchRegistrar registrar_;
  std::vector<int> keyframes_;  // of the segment
};

void add_to(Structure& map, const Structure& segment, const Sim3& map_from_segment) {
  for (std::size_t k = 0; k < map.frames.size(); ++k) {
    if (!segment.placed[k]) continue;
    map.placed[k] = true;
    map.cam_from_world[k] = (map_from_segment * segment.cam_from_world[k].inverse()).inverse();
  }
  for (const Track& track : segment.tracks) {
    map.tracks.push_back(track);
    map.tracks.back().point = map_from_segment * track.point;
  }
}

}  // namespace

std::optional<Sim3> map_from_segment(const FrameSource& frames, const Structure& map,
                                     const std::vector<WallPatch>& patches,
                                     const Structure& segment, const RevisitOptions& options,
                                     const BundleOptions& bundle) {
  const Finder finder(frames, map, patches, segment, options, bundle);
  for (const Break& at : breaks_between(map, segment))
    if (const auto found = finder.find(at)) return found;
  return std::nullopt;
}

int rejoin(const FrameSource& frames, std::vector<Structure> segments,
           const RevisitOptions& options, const BundleOptions& bundle, Structure& map,
           Progress& progress) {
  Progress quiet(Progress::Output::silent);
  progress.begin("segments", segments.size());
  for (Structure& segment : segments)
    finish_moving(frames, bundle, kDraftAdjustment, segment, quiet);
  const std::size_t count = segments.size();
  for (bool changed = true; changed;) {
    changed = false;
    const std::vector<WallPatch> patches = make_patches(frames, map);
    for (auto segment = segments.begin(); segment != segments.end(); ++segment) {
      const auto found = map_from_segment(frames, map, patches, *segment, options, bundle);
      if (!found) continue;
      add_to(map, *segment, *found);
      segments.erase(segment);
      progress.step();
      changed = true;
      break;
    }
  }
  const auto moved = static_cast<int>(count - segments.size());
  progress.end(fmt::format("{} of {} found their place", moved, count));
  return moved;
}

}  // namespace rugae
