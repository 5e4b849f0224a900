#pragma once
// Poses of the key frames and sparse points: tracks from the inlier correspondences, incremental
// start, bundle adjustment.

#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "core/progress.h"
#include "core/rigid3.h"
#include "recon/align.h"
#include "recon/options.h"

namespace rugae {

/// A wall point seen in several key frames.
struct Track {
  struct Observation {
    int keyframe = -1;  // position in the list of key frames, not the frame's index
    Vec2 pixel;
    Vec2 ray = Vec2::Zero();  // (x/z, y/z) of the pixel, set by set_rays()
    bool inlier = true;       // false: does not agree with the point; never in a finished structure
  };
  std::vector<Observation> observations;
  Vec3 point = Vec3::Zero();  // world, map units
  bool triangulated = false;
};

/// Key frame poses and points. The world is the camera of the first key frame that was placed, and
/// the map unit is the median depth of the points that camera sees: one camera fixes no scale.
/// Light may (recon/dense/metric_scale.h).
struct Structure {
  std::vector<int> frames;             // of the key frames, as selected
  std::vector<bool> placed;            // false: this key frame could not be placed
  std::vector<Rigid3> cam_from_world;  // of the key frames
  std::vector<Track> tracks;
  double mean_reprojection_px = 0.0;
  int iterations = 0;
  bool converged = false;
  /// Where the unit is the millimetre: standard deviation of all lengths together, as a share.
  std::optional<double> scale_sigma_share;

  int placed_count() const;
};

/// Of each key frame the tracks it sees, in order.
using SeenTracks = std::vector<std::vector<std::size_t>>;
SeenTracks seen_tracks(const Structure& structure);

/// How far the joint adjustment of all goes.
struct Adjustment {
  int rounds;                 // between which the observations are judged anew
  double function_tolerance;  // relative change of the cost at which a round ends
};
/// A tolerance of 1e-7 takes up to seven times as long on rendered frames, where steps across
/// Huber's width converge slowly, and changes the error of a path by a thousandth (0.969 and 0.968
/// mm).
inline constexpr Adjustment kFinalAdjustment{3, 1e-6};
/// For poses that only lead to more observations and are adjusted again with them.
inline constexpr Adjustment kDraftAdjustment{1, 1e-5};

/// Rays of all observations from their pixels; an observation the lens has no ray for is removed.
void set_rays(std::vector<Track>& tracks, const Lens& lens);

/// Places the key frames one after another from the best pair on. `frames` are the key frames'
/// indices, `lens` that of the preprocessed frames. Where the chain breaks a new segment begins;
/// segments that share enough points are joined to the largest. Each that is left has a structure
/// of its own, with the tracks that its key frames see, in the order of their size, not yet
/// finished. Throws nothing for hopeless input: then there is one, and no key frame is placed.
std::vector<Structure> build_segments(const std::vector<int>& frames, std::vector<Track> tracks,
                                      const Lens& lens, const BundleOptions& options,
                                      Progress& progress);

/// The largest segment, all of it adjusted jointly: key frames of the others are not placed.
Structure build_structure(const std::vector<int>& frames, std::vector<Track> tracks,
                          const Lens& lens, const BundleOptions& options,
                          const Adjustment& adjustment, Progress& progress);

/// The joint adjustment over all placed key frames; what does not agree is removed, the structure
/// is normalised, and its numbers are set.
void finish_structure(Structure& structure, const Lens& lens, const BundleOptions& options,
                      const Adjustment& adjustment, Progress& progress);

/// Removes observations that do not agree with their point, those of key frames that are not
/// placed, and tracks without a point.
void remove_outliers(Structure& structure);

/// The end of the above without adjusting: for poses that are not to be moved.
void settle_structure(Structure& structure, double focal_px);

/// Moves the world into the camera of the first placed key frame and scales it so that the median
/// depth of the points it sees is one.
void normalise(Structure& structure);

/// All lengths times `factor`.
void rescale(Structure& structure, double factor);

}  // namespace rugae
