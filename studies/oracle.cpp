#include "studies/oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/check.h"
#include "core/sim3.h"
#include "recon/frames_between.h"
#include "recon/growth.h"
#include "recon/resection.h"
#include "studies/true_motion.h"

namespace rugae {
namespace {

constexpr double kOutlierPx = 4.0;       // times huber_px, of points triangulated from true poses
constexpr std::size_t kMaxPoints = 400;  // that place a frame, as the reconstruction takes

// Pixels of the frames as observed and as the reconstruction sees them, by the lens that it uses.
class Grids {
 public:
  Grids(const Lens& observed, const Lens& preprocessed)
      : observed_(observed), preprocessed_(preprocessed) {}
  std::optional<Vec2> observed(const Vec2& pixel) const {
    const auto ray = preprocessed_.unproject(pixel);
    return ray ? observed_.project(*ray) : std::nullopt;
  }
  std::optional<Vec2> preprocessed(const Vec2& pixel) const {
    const auto ray = observed_.unproject(pixel);
    return ray ? preprocessed_.project(*ray) : std::nullopt;
  }

 private:
  LensProjector observed_, preprocessed_;
};

// An observation, and the pixel in which its track began.
struct Moved {
  Track::Observation* observation;
  Vec2 first_px;
};

class Oracle {
 public:
  Oracle(const std::filesystem::path& dataset, const Lens& lens) : motion_(dataset), lens_(lens) {}

  Followed true_tracks(const FrameSource& frames, Followed followed) const {
    const Grids grids(lens_, frames.lens());
    std::vector<Track>& tracks = followed.tracks;
    // The wall point of a track is what its first observation sees.
    std::map<std::pair<int, int>, std::vector<Moved>> seen_in;  // by first and other key frame
    for (Track& track : tracks) {
      const Track::Observation first = track.observations.front();  // which is moved as well
      for (Track::Observation& o : track.observations)
        seen_in[{first.keyframe, o.keyframe}].push_back({&o, first.pixel});
    }
    for (const auto& [keyframes, group] : seen_in)
      move_observations(followed.keyframes[keyframes.first], followed.keyframes[keyframes.second],
                        grids, group);
    for (Track& track : tracks)
      std::erase_if(track.observations, [](const auto& o) { return !o.inlier; });
    std::erase_if(tracks, [](const Track& track) { return track.observations.size() < 2; });
    set_rays(tracks, frames.lens());
    return followed;
  }

  std::vector<std::optional<Rigid3>> resect(const FrameSource& frames, const Structure& structure,
                                            const ReconOptions& options, Progress& progress) const {
    auto poses = keyframe_poses(structure, frames.size());
    const std::vector<int> keyframes = placed_keyframes(structure);
    progress.begin("resection by the true correspondences", poses.size());
    for (int f = 0; f < frames.size() && !keyframes.empty(); ++f) {
      progress.step();
      if (poses[f]) continue;
      const int nearest = *std::ranges::min_element(
          keyframes, {}, [&](int k) { return std::abs(structure.frames[k] - f); });
      poses[f] = place(frames, structure, nearest, f, options.bundle);
    }
    progress.end();
    return poses;
  }

  // All key frames where they truly are, in the units of the reconstruction; points from our
  // tracks.
  Structure true_structure(const FrameSource& frames, const std::vector<int>& keyframes,
                           std::vector<Track> tracks, const ReconOptions& options) const {
    Structure s;
    s.frames = keyframes;
    s.placed.assign(keyframes.size(), true);
    s.tracks = std::move(tracks);
    for (const int f : keyframes) s.cam_from_world.push_back(true_pose(f).inverse());
    update_points(s, frames.lens().fx, kOutlierPx * options.bundle.huber_px, options.bundle);
    settle_structure(s, frames.lens().fx);
    s.converged = true;
    return s;
  }

  // In the world of a structure whose key frames are where they truly are.
  std::vector<std::optional<Rigid3>> true_poses(const FrameSource& frames,
                                                const Structure& structure) const {
    const Sim3 map_from_world = map_from_true_world(structure);
    std::vector<std::optional<Rigid3>> poses;
    for (int f = 0; f < frames.size(); ++f)
      poses.push_back((map_from_world * true_pose(f)).inverse());
    for (std::size_t k = 0; k < structure.frames.size(); ++k)
      poses[structure.frames[k]] = structure.cam_from_world[k];
    return poses;
  }

  // The true depth where ours has any, in the units of the reconstruction.
  std::optional<MosaicDepth> true_depth(std::optional<MosaicDepth> ours, const Mosaic& mosaic,
                                        const Structure& structure, const Lens& lens) const {
    if (!ours) return ours;
    const double map_per_mm = map_from_true_world(structure).scale;
    const LensProjector projector(lens);
    std::vector<Vec3> rays;
    std::vector<float*> places;
    for (int y = 0; y < ours->depth.rows; ++y)
      for (int x = 0; x < ours->depth.cols; ++x) {
        float& z = ours->depth.at<float>(y, x);
        if (!std::isfinite(z)) continue;
        z = std::numeric_limits<float>::quiet_NaN();
        const auto ray = projector.unproject(mosaic.origin_px + Vec2(x + 0.5, y + 0.5));
        if (!ray || !(ray->z() > 0.0)) continue;
        rays.push_back(*ray / ray->z());
        places.push_back(&z);
      }
    const std::vector<double> depths = motion_.depths_mm(structure.frames[mosaic.anchor], rays);
    for (std::size_t i = 0; i < places.size(); ++i)
      *places[i] = static_cast<float>(map_per_mm * depths[i]);
    return ours;
  }

 private:
  Rigid3 true_pose(int frame) const {  // world_from_camera, mm
    return motion_.truth().track()[static_cast<std::size_t>(frame)].world_from_camera;
  }

  // Moves observations in frame `to` to where the wall points that their tracks began with in frame
  // `from` are seen; those that are hidden are marked.
  void move_observations(int from, int to, const Grids& grids,
                         const std::vector<Moved>& group) const {
    std::vector<Track::Observation*> observations;
    std::vector<Vec2> begun;
    for (const Moved& moved : group) {
      moved.observation->inlier = false;
      const auto pixel = grids.observed(moved.first_px);
      if (!pixel) continue;
      observations.push_back(moved.observation);
      begun.push_back(*pixel);
    }
    const auto landings = motion_.follow(from, to, begun);
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (landings[i].sight != TrueLanding::Sight::seen) continue;
      const auto pixel = grids.preprocessed(landings[i].pixel);
      observations[i]->inlier = pixel.has_value();
      if (pixel) observations[i]->pixel = *pixel;
    }
  }

  // A frame by the points that a key frame sees.
  std::optional<Rigid3> place(const FrameSource& frames, const Structure& structure, int keyframe,
                              int frame, const BundleOptions& options) const {
    const Grids grids(lens_, frames.lens());
    std::vector<Vec3> points;
    std::vector<Vec2> there;
    for (const Track& track : structure.tracks)
      for (const Track::Observation& o : track.observations) {
        if (o.keyframe != keyframe || points.size() == kMaxPoints) continue;
        const auto pixel = grids.observed(o.pixel);
        if (!pixel) continue;
        points.push_back(track.point);
        there.push_back(*pixel);
      }
    const auto here = motion_.follow(structure.frames[keyframe], frame, there);
    const LensProjector projector(frames.lens());
    std::vector<Vec3> seen;
    std::vector<Vec2> rays;
    for (std::size_t i = 0; i < here.size(); ++i) {
      const auto pixel = here[i].sight == TrueLanding::Sight::seen
                             ? grids.preprocessed(here[i].pixel)
                             : std::nullopt;
      const auto ray = pixel ? ray_of(projector, *pixel) : std::nullopt;
      if (!ray) continue;
      seen.push_back(points[i]);
      rays.push_back(*ray);
    }
    const auto placed = place_by_points(seen, rays, frames.lens().fx, options);
    return placed ? std::optional(placed->cam_from_world) : std::nullopt;
  }

  Sim3 map_from_true_world(const Structure& structure) const {
    std::vector<Vec3> truth, ours;
    for (std::size_t k = 0; k < structure.frames.size(); ++k) {
      if (!structure.placed[k]) continue;
      truth.push_back(true_pose(structure.frames[k]).translation);
      ours.push_back(structure.cam_from_world[k].inverse().translation);
    }
    const auto found = umeyama(truth, ours, true);
    check(found.has_value(),
          "{} key frames are placed, or all on a line: the units of the map "
          "cannot be told",
          truth.size());
    return *found;
  }

  TrueMotion motion_;
  Lens lens_;
};

}  // namespace

const std::vector<std::string>& replace_names() {
  static const std::vector<std::string> kNames = {"nothing",         "lens",  "frames",
                                                  "correspondences", "poses", "depth"};
  return kNames;
}

Stages stages_with(Replace replace, const std::filesystem::path& dataset, const Lens& lens) {
  Stages stages;
  const bool in_stages =
      replace == Replace::correspondences || replace == Replace::poses || replace == Replace::depth;
  if (!in_stages) return stages;
  const auto oracle = std::make_shared<const Oracle>(dataset, lens);
  const Stages ours;
  if (replace == Replace::correspondences) {
    stages.follow = [=](const FrameSource& frames, const ReconOptions& options,
                        Progress& progress) {
      return oracle->true_tracks(frames, ours.follow(frames, options, progress));
    };
    stages.resect = [=](const FrameSource& frames, const Structure& structure,
                        const ReconOptions& options, Progress& progress) {
      return oracle->resect(frames, structure, options, progress);
    };
  }
  if (replace == Replace::poses) {
    stages.structure = [=](const FrameSource& frames, const std::vector<int>& keyframes,
                           std::vector<Track> tracks, const ReconOptions& options, Progress&) {
      return oracle->true_structure(frames, keyframes, std::move(tracks), options);
    };
    stages.resect = [=](const FrameSource& frames, const Structure& structure, const ReconOptions&,
                        Progress&) { return oracle->true_poses(frames, structure); };
  }
  if (replace == Replace::depth)
    stages.depth = [=](const Mosaic& mosaic, const Structure& structure, const Lens& map_lens,
                       const ReconOptions& options) {
      return oracle->true_depth(ours.depth(mosaic, structure, map_lens, options), mosaic, structure,
                                map_lens);
    };
  return stages;
}

}  // namespace rugae
