#include "recon/dense/revisits.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/bundle.h"
#include "recon/growth.h"
#include "recon/refine.h"
#include "recon/resection.h"
#include "recon/tracks.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;
constexpr double kPatchRadiusPx = 12.0;  // of the registration, at 640 px width
constexpr double kMinCorrelation = 0.7;  // of registered patches
constexpr double kMaxShiftPx = 1.5;      // by which registration may move a track's observation
constexpr int kTemplateHalfPx = 4;       // of the search, coarse
constexpr float kMinSearchScore = 0.6F;
constexpr std::size_t kAtOnce = 16;  // key frames between two steps of the progress line
constexpr int kGroupGap = 8;         // key frames between the anchors of one group
constexpr double kOutlierHubers = 3.0;

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

// The anchor's coarse square as the key frame sees it: a square template around the point.
cv::Mat warped_template(const WallPatch& patch, const Mat2& linear) {
  constexpr int kSide = 2 * kTemplateHalfPx + 1;
  const Mat2 back = linear.inverse();
  cv::Mat places(kSide, kSide, CV_32FC2), result;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const Vec2 at =
          patch.coarse_px + back * Vec2(x - kTemplateHalfPx, y - kTemplateHalfPx) - Vec2(0.5, 0.5);
      places.at<cv::Vec2f>(y, x) = {static_cast<float>(at.x()), static_cast<float>(at.y())};
    }
  cv::remap(patch.coarse, result, places, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return result;
}

// The pixel within `reach_px` (coarse) of the foretold one where the patch fits best.
std::optional<Vec2> search(const WallPatch& patch, const PatchSight& sight, const PatchImage& image,
                           int reach_px) {
  if (patch.coarse.empty()) return std::nullopt;
  const Vec2 at = sight.pixel / image.shrink;
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  const int half = kTemplateHalfPx + reach_px;
  const cv::Rect window = cv::Rect(x - half, y - half, 2 * half + 1, 2 * half + 1) &
                          cv::Rect({0, 0}, image.coarse.size());
  constexpr int kSide = 2 * kTemplateHalfPx + 1;
  if (window.width < kSide || window.height < kSide) return std::nullopt;
  // The template's middle stands for the point, whatever its fraction of a pixel.
  cv::Mat scores;
  cv::matchTemplate(image.coarse(window), warped_template(patch, sight.linear), scores,
                    cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point place;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &place);
  if (!(best >= kMinSearchScore)) return std::nullopt;
  const Vec2 middle(window.x + place.x + kTemplateHalfPx + 0.5,
                    window.y + place.y + kTemplateHalfPx + 0.5);
  return middle * image.shrink;
}

bool usable_at(const cv::Mat& usable, const Vec2& pixel) {
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  return x >= 0 && y >= 0 && x < usable.cols && y < usable.rows &&
         usable.at<unsigned char>(y, x) != 0;
}

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
                           const std::vector<WallPatch>& patches, const Lens& lens,
                           const BundleOptions& bundle) {
  std::vector<Seen> kept;
  for (const auto& [begin, end] : groups_by_anchor(candidates, patches)) {
    std::vector<Vec3> points;
    std::vector<Vec2> rays;
    std::vector<std::size_t> which;
    for (std::size_t i = begin; i < end; ++i) {
      const auto ray = ray_of(lens, candidates[i].pixel);
      if (!ray) continue;
      points.push_back(patches[candidates[i].patch].centre);
      rays.push_back(*ray);
      which.push_back(i);
    }
    const auto placement = place_by_points(points, rays, lens.fx, bundle);
    if (!placement) continue;
    for (std::size_t i = 0; i < which.size(); ++i)
      if (placement->inlier[i]) kept.push_back(candidates[which[i]]);
  }
  return kept;
}

// Which observation of each track is in which key frame.
std::vector<std::vector<int>> observation_of(const Structure& structure,
                                             const std::vector<WallPatch>& patches) {
  std::vector<std::vector<int>> of(structure.frames.size(), std::vector<int>(patches.size(), -1));
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const Track& track = structure.tracks[static_cast<std::size_t>(patches[p].track)];
    for (std::size_t i = 0; i < track.observations.size(); ++i)
      of[static_cast<std::size_t>(track.observations[i].keyframe)][p] = static_cast<int>(i);
  }
  return of;
}

FrameResult look_in(int keyframe, const PatchImage& image, const std::vector<WallPatch>& patches,
                    const std::vector<int>& known, const Structure& structure, const Lens& lens,
                    const RevisitOptions& options, const BundleOptions& bundle) {
  const double scale = lens.width / kReferenceWidthPx;
  PointRefinementOptions refinement;
  refinement.radius_px = kPatchRadiusPx * scale;
  refinement.min_correlation = kMinCorrelation;
  refinement.max_motion_px = 4.0 * scale;
  const PointRefiner refiner(refinement);
  const LensProjector projector(lens);
  const Rigid3& pose = structure.cam_from_world[static_cast<std::size_t>(keyframe)];
  const int reach_px = static_cast<int>(std::ceil(options.search_px * scale / image.shrink));
  FrameResult result;
  std::vector<Seen> candidates;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const WallPatch& patch = patches[p];
    if (patch.anchor == keyframe) continue;
    const auto sight = foretell(patch, pose, projector);
    if (!sight) continue;
    std::optional<Vec2> start;
    if (known[p] >= 0) {
      start = structure.tracks[static_cast<std::size_t>(patch.track)]
                  .observations[static_cast<std::size_t>(known[p])]
                  .pixel;
    } else {
      if (!usable_at(image.usable, sight->pixel)) continue;
      ++result.foretold;
      start = search(patch, *sight, image, reach_px);
    }
    if (!start) continue;
    const auto pixel = refiner(patch.fine, image.fine, patch.fine_px, *start, sight->linear);
    if (!pixel || !usable_at(image.usable, *pixel)) continue;
    if (known[p] < 0) {
      candidates.push_back({p, *pixel});
    } else if ((*pixel - *start).norm() <= kMaxShiftPx * scale) {
      result.registered.push_back({p, *pixel, known[p]});
    }
  }
  result.found = candidates.size();
  result.added = agreeing(candidates, patches, lens, bundle);
  return result;
}

}  // namespace

RevisitReport observe_again(const FrameSource& frames, const std::vector<WallPatch>& patches,
                            const RevisitOptions& options, const BundleOptions& bundle,
                            Structure& structure, Progress& progress) {
  const std::size_t n = structure.frames.size();
  const auto known = observation_of(structure, patches);
  std::vector<FrameResult> results(n);
  for (std::size_t begin = 0; begin < n; begin += kAtOnce) {
    const std::size_t end = std::min(n, begin + kAtOnce);
    tbb::parallel_for(begin, end, [&](std::size_t k) {
      if (!structure.placed[k]) return;
      const PatchImage image = prepare_patch_image(frames.pose_frame(structure.frames[k]));
      results[k] = look_in(static_cast<int>(k), image, patches, known[k], structure, frames.lens(),
                           options, bundle);
    });
    progress.step(end - begin);
  }
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
  set_rays(structure.tracks, frames.lens());
  return report;
}

void link_revisits(const FrameSource& frames, const RevisitOptions& options,
                   const BundleOptions& bundle, Structure& structure, Progress& progress) {
  for (int round = 0; round < options.rounds; ++round) {
    progress.begin("revisits", structure.frames.size());
    const std::vector<WallPatch> patches = make_patches(frames, structure);
    const RevisitReport report =
        observe_again(frames, patches, options, bundle, structure, progress);
    progress.end(fmt::format(
        "{} patches, {} sights registered, {} looked for, {} found, {} accepted", report.patches,
        report.registered, report.foretold, report.found, report.accepted));
    finish_structure(structure, frames.lens(), bundle, progress);
  }
}

}  // namespace rugae
