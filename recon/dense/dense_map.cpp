#include "recon/dense/dense_map.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>

#include "core/check.h"
#include "core/in_lots.h"
#include "core/spread.h"
#include "recon/cache.h"
#include "recon/dense/albedo.h"
#include "recon/dense/consistency.h"
#include "recon/dense/depth_map.h"
#include "recon/dense/smooth_wall.h"
#include "recon/dense/view_choice.h"
#include "recon/dense/volume.h"
#include "recon/mesh_pieces.h"

namespace rugae {
namespace {

constexpr std::size_t kAtOnce = 8;        // depth maps between two steps of the progress line
constexpr std::size_t kCachedViews = 48;  // frames as stereo sees them: 0.7 MB each
/// Agreeing pixels in smaller groups than this are chance, of a depth map 400 px wide.
constexpr double kSmallestIslandPx = 60.0;
/// Pieces with less than this share of the triangles of the largest piece are noise.
constexpr double kSmallestPiece = 0.01;

/// Key frames as the camera would have seen them had it stood still.
class StillKeyframes {
 public:
  StillKeyframes(const WideFrames& wide, const Structure& structure,
                 const std::vector<CameraMotion>& motions)
      : wide_(wide), structure_(structure), motions_(motions) {
    for (int level = 1; level < kStereoLevels; ++level) coarsest_ = halved(coarsest_);
  }

  const PinholeGrid& grid() const { return wide_.grid(); }
  const Structure& structure() const { return structure_; }
  DepthPrior prior(int keyframe) const { return depth_prior(structure_, keyframe, coarsest_); }
  WideFrame read(int keyframe) const {
    const int frame = structure_.frames[keyframe];
    if (motions_.empty()) return wide_.read(frame);
    const DepthPrior around = prior(keyframe);
    return around.depth.empty() ? wide_.read(frame)
                                : wide_.read(frame, motions_[keyframe], around.depth);
  }
  cv::Mat albedo(int keyframe, const DepthMap& map) const {
    return albedo_of(read(keyframe), wide_.vignetting_gain(), map);
  }

 private:
  const WideFrames& wide_;
  const Structure& structure_;
  PinholeGrid coarsest_ = wide_.grid();
  const std::vector<CameraMotion>& motions_;  // empty: all rows were read at once
};

/// Key frames as stereo sees them, the latest kept, and of all that were read the coarsest level:
/// an eighth of a megabyte each, so that none is read twice.
class Views {
 public:
  Views(const StillKeyframes& frames, const DenseOptions& options)
      : frames_(frames), options_(options) {}

  std::shared_ptr<const StereoView> view(int keyframe) {
    return cache_.get(keyframe, [&] {
      StereoView view{frames_.structure().cam_from_world[keyframe],
                      stereo_levels(frames_.read(keyframe), frames_.grid(), kStereoLevels,
                                    options_.window_radius_px)};
      StereoView coarsest = view;
      for (int level = 0; level + 1 < kStereoLevels; ++level)
        coarsest.levels[level].texture.release();
      {
        const std::lock_guard lock(mutex_);
        coarsest_.try_emplace(keyframe, std::make_shared<const StereoView>(std::move(coarsest)));
      }
      return std::make_shared<const StereoView>(std::move(view));
    });
  }
  /// Of a view that was asked for before.
  std::shared_ptr<const StereoView> coarsest(int keyframe) const { return coarsest_.at(keyframe); }

 private:
  std::mutex mutex_;
  std::map<int, std::shared_ptr<const StereoView>> coarsest_;
  const StillKeyframes& frames_;
  const DenseOptions& options_;
  Cache<std::shared_ptr<const StereoView>> cache_{kCachedViews};
};

/// The views of a set, held.
struct StereoViews {
  template <typename ViewOf>
  StereoViews(const StereoSet& set, ViewOf view_of) : reference(view_of(set.reference)) {
    for (const int source : set.sources) {
      held.push_back(view_of(source));
      sources.push_back(held.back().get());
    }
  }
  std::shared_ptr<const StereoView> reference;
  std::vector<std::shared_ptr<const StereoView>> held;
  std::vector<const StereoView*> sources;
};

std::vector<DepthMap> depth_maps(const StillKeyframes& frames, const std::vector<StereoSet>& sets,
                                 Views& views, const DenseOptions& options, Progress& progress) {
  progress.begin("stereo", sets.size());
  std::vector<DepthMap> maps(sets.size());
  do_in_lots(sets.size(), kAtOnce, progress, [&](std::size_t i) {
    const StereoViews seen(sets[i], [&](int k) { return views.view(k); });
    maps[i] =
        estimate_depth(*seen.reference, seen.sources, frames.prior(sets[i].reference), options);
  });
  return maps;
}

/// Leaves of each depth map what others agree with; all are compared as they were found. `unsure`:
/// where (CV_8U) this is asked, of each map; empty: everywhere.
void keep_consistent(std::vector<DepthMap>& maps, const std::vector<cv::Mat>& unsure,
                     const DenseOptions& options) {
  const auto overlapping = overlapping_maps(maps, kComparedMaps);
  std::vector<cv::Mat> agreeing(maps.size());
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t i) {
    std::vector<const DepthMap*> others;
    for (const int j : overlapping[i]) others.push_back(&maps[j]);
    agreeing[i] = agreeing_maps(maps[i], others, options.consistent_sigmas);
    if (!unsure.empty()) agreeing[i].setTo(options.consistent_maps, unsure[i] == 0);
  });
  const double scale = maps.front().grid.width / 400.0;
  const int smallest = static_cast<int>(kSmallestIslandPx * scale * scale);
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t i) {
    keep_agreed(maps[i], agreeing[i], options.consistent_maps, smallest);
  });
}

/// Fills what the depth maps leave open, where the wall between what they found is known well
/// enough to look again or to be believed, and where they agree on that too.
void fill_gaps(const StillKeyframes& frames, const std::vector<StereoSet>& sets, const Views& views,
               std::vector<DepthMap>& maps, const DenseOptions& options, Progress& progress) {
  progress.begin("gaps", maps.size());
  std::vector<cv::Mat> filled(maps.size());
  do_in_lots(sets.size(), kAtOnce, progress, [&](std::size_t i) {
    filled[i] = cv::Mat(maps[i].depth.size(), CV_8U, cv::Scalar(0));
    const auto wall =
        smooth_wall(maps[i], sparse_depths(frames.structure(), sets[i].reference, frames.grid()),
                    frames.prior(sets[i].reference), static_cast<std::uint32_t>(i));
    if (!wall) return;
    const StereoViews seen(sets[i], [&](int k) { return views.coarsest(k); });
    filled[i] = look_again(*seen.reference, seen.sources, wall->depth, options, maps[i]);
    filled[i] |= fill_from(*wall, options.gap_sigma_share, maps[i]);
  });
  keep_consistent(maps, filled, options);
}

// Some of the depth maps, as they were found.
std::vector<DepthExample> examples_of(const StillKeyframes& frames,
                                      const std::vector<StereoSet>& sets,
                                      const std::vector<DepthMap>& maps,
                                      const std::vector<int>& which) {
  std::vector<DepthExample> examples;
  for (const int i : which) {
    DepthExample& example = examples.emplace_back();
    example.frame = frames.structure().frames[sets[i].reference];
    frames.read(sets[i].reference).bgr.convertTo(example.picture, CV_8U);
    example.found = maps[i].depth.clone();
  }
  return examples;
}

double median(std::vector<float>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

TriangleMesh fuse(const StillKeyframes& frames, const std::vector<StereoSet>& sets,
                  const std::vector<DepthMap>& maps, double voxel, Progress& progress) {
  progress.begin("fusion", maps.size());
  DistanceVolume volume(voxel);
  // One after another: a voxel's mean depends on the order in its last bits.
  make_in_lots(
      maps.size(), kAtOnce, progress,
      [&](std::size_t i) { return frames.albedo(sets[i].reference, maps[i]); },
      [&](std::size_t i, const cv::Mat& colours) { volume.integrate(maps[i], colours); });
  return volume.extract();
}

}  // namespace

DenseMap build_dense_map(const FrameSource& frames, const Structure& structure,
                         const std::vector<CameraMotion>& motions,
                         const ReflectionOptions& reflections, const DenseOptions& options,
                         int examples, Progress& progress) {
  check(motions.empty() || motions.size() == structure.frames.size(),
        "dense map: {} motions of {} key frames", motions.size(), structure.frames.size());
  reflections.check();
  options.check();
  DenseMap result;
  const std::vector<StereoSet> sets = choose_views(structure, options);
  if (sets.empty()) return result;
  const WideFrames wide(frames, reflections, options.width_px);
  const StillKeyframes still(wide, structure, motions);
  Views views(still, options);
  std::vector<DepthMap> maps = depth_maps(still, sets, views, options, progress);
  progress.begin("consistency");
  const std::vector<int> shown = spread(static_cast<int>(maps.size()), examples);
  result.examples = examples_of(still, sets, maps, shown);
  keep_consistent(maps, {}, options);
  if (options.gap_sigma_share > 0.0) fill_gaps(still, sets, views, maps, options, progress);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    result.examples[i].agreed = maps[shown[i]].depth;
    result.examples[i].sigma = maps[shown[i]].sigma;
  }

  std::vector<float> widths, sigmas;  // of a pixel on the wall; over the depth
  std::size_t pixels = 0;
  for (const DepthMap& map : maps) {
    pixels += map.depth.total();
    for (int y = 0; y < map.grid.height; ++y)
      for (int x = 0; x < map.grid.width; ++x) {
        const float z = map.depth.at<float>(y, x);
        if (!(z > 0.0f)) continue;
        widths.push_back(z / static_cast<float>(map.grid.fx));
        sigmas.push_back(map.sigma.at<float>(y, x) / z);
      }
  }
  result.depth_maps = static_cast<int>(maps.size());
  result.depth_share = static_cast<double>(sigmas.size()) / static_cast<double>(pixels);
  result.median_sigma = median(sigmas);
  progress.end(fmt::format("{:.0f} % of {} depth maps, sigma {:.2g} of the depth",
                           100.0 * result.depth_share, maps.size(), result.median_sigma));
  if (widths.empty()) return result;

  const TriangleMesh surface = fuse(still, sets, maps, options.voxel_px * median(widths), progress);
  result.mesh = part_of(surface, vertices_of_large_pieces(surface, kSmallestPiece));
  to_display(result.mesh.colors);
  result.mesh.normals = angle_weighted_normals(result.mesh);
  progress.end(fmt::format("{} triangles", result.mesh.triangles.size()));
  return result;
}

}  // namespace rugae
