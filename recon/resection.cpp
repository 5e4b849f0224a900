#include "recon/resection.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "core/in_lots.h"
#include "recon/bundle.h"
#include "recon/cache.h"
#include "recon/flow_guess.h"
#include "recon/frames_between.h"
#include "recon/tracks.h"

namespace rugae {
namespace {

constexpr int kRansacIterations = 300;
constexpr double kRansacConfidence = 0.9999;
constexpr double kInlierHubers = 3.0;     // an inlier is within this many times huber_px
constexpr double kMinInlierShare = 0.25;  // fewer: chance could have found them
constexpr int kMinPoints = 6;
constexpr std::size_t kMaxPoints = 400;  // followed into a frame: more adds time and no precision
constexpr int kRefinements = 2;
constexpr std::size_t kReferencesHeld = 8;
constexpr int kFramesAtOnce = 16;  // between two steps of the progress line

// Sights of known points from one frame.
struct Sighted {
  std::vector<Vec3> points;
  std::vector<Vec2> rays;
};

// A known point as a key frame sees it.
struct Seen {
  Vec3 point;
  Vec2 pixel;
};

std::vector<Seen> at_most(std::size_t count, const std::vector<Seen>& points) {
  const std::size_t stride = 1 + points.size() / count;
  std::vector<Seen> chosen;
  for (std::size_t i = 0; i < points.size(); i += stride) chosen.push_back(points[i]);
  return chosen;
}

// The triangulated points of a key frame, at most kMaxPoints.
std::vector<Seen> points_seen_by(const Structure& structure, int keyframe) {
  std::vector<Seen> seen;
  for (const Track& track : structure.tracks) {
    if (!track.triangulated) continue;
    for (const auto& o : track.observations)
      if (o.keyframe == keyframe && o.inlier) seen.push_back({track.point, o.pixel});
  }
  return at_most(kMaxPoints, seen);
}

// Of each key frame, in one pass.
std::vector<std::vector<Seen>> points_seen(const Structure& structure) {
  std::vector<std::vector<Seen>> seen(structure.frames.size());
  for (const Track& track : structure.tracks) {
    if (!track.triangulated) continue;
    for (const auto& o : track.observations)
      if (o.inlier) seen[o.keyframe].push_back({track.point, o.pixel});
  }
  for (std::vector<Seen>& points : seen) points = at_most(kMaxPoints, points);
  return seen;
}

// Follows the points of one key frame, `reference`, into a frame that is thought to be near
// `cam_from_world`.
Sighted follow(const Lens& lens, const std::vector<Seen>& seen, const AlignImage& reference,
               const AlignImage& moving, const std::optional<Rigid3>& cam_from_world,
               const AlignOptions& align_options, std::uint64_t seed) {
  AlignGuess guess;
  guess.affine = false;
  const LensProjector projector(lens);
  std::vector<Vec2> from, to;
  for (const Seen& s : seen) {
    guess.reference_points.push_back(s.pixel);
    if (!cam_from_world) continue;
    const auto there = projector.project(*cam_from_world * s.point);
    if (!there) continue;
    from.push_back(s.pixel);
    to.push_back(*there);
  }
  Sighted sighted;
  guess.flow = guess_flow(from, to, 1.0, reference.gray.size());
  const auto pair = align(reference, moving, align_options,
                          pair_seed(seed, reference.index, moving.index), guess);
  if (!pair) return sighted;
  for (std::size_t i = 0; i < pair->point_index.size(); ++i) {
    const auto ray = ray_of(projector, pair->moving_px[i]);
    if (!ray) continue;
    sighted.points.push_back(seen[pair->point_index[i]].point);
    sighted.rays.push_back(*ray);
  }
  return sighted;
}

}  // namespace

std::optional<Placement> place_by_points(const std::vector<Vec3>& points,
                                         const std::vector<Vec2>& rays, double focal_px,
                                         const BundleOptions& options) {
  const std::size_t n = points.size();
  if (static_cast<int>(n) < std::max(kMinPoints, options.min_resection_inliers)) return {};
  std::vector<cv::Point3d> objects;
  std::vector<cv::Point2d> pixels;
  for (std::size_t i = 0; i < n; ++i) {
    objects.emplace_back(points[i].x(), points[i].y(), points[i].z());
    pixels.emplace_back(focal_px * rays[i].x(), focal_px * rays[i].y());
  }
  const cv::Mat k = (cv::Mat_<double>(3, 3) << focal_px, 0, 0, 0, focal_px, 0, 0, 0, 1);
  const double threshold_px = kInlierHubers * options.huber_px;
  cv::Mat rotation_vector, translation, rotation;
  if (!cv::solvePnPRansac(objects, pixels, k, cv::noArray(), rotation_vector, translation, false,
                          kRansacIterations, static_cast<float>(2.0 * threshold_px),
                          kRansacConfidence, cv::noArray(), cv::SOLVEPNP_AP3P))
    return {};
  cv::Rodrigues(rotation_vector, rotation);
  Mat3 r;
  Vec3 t;
  cv::cv2eigen(rotation, r);
  cv::cv2eigen(translation, t);
  if (!r.allFinite() || !t.allFinite()) return {};

  Placement placement;
  placement.cam_from_world = Rigid3(r, t);
  const auto count = [&](double limit_px) {
    placement.inlier.assign(n, 0);
    placement.inliers = 0;
    for (std::size_t i = 0; i < n; ++i) {
      placement.inlier[i] =
          reprojection_px(placement.cam_from_world, points[i], rays[i], focal_px) <= limit_px;
      placement.inliers += placement.inlier[i];
    }
  };
  count(2.0 * threshold_px);
  for (int round = 0; round < kRefinements; ++round) {
    Sighted good;
    for (std::size_t i = 0; i < n; ++i) {
      if (!placement.inlier[i]) continue;
      good.points.push_back(points[i]);
      good.rays.push_back(rays[i]);
    }
    refine_pose(placement.cam_from_world, good.points, good.rays, focal_px, options.huber_px, 20);
    count(threshold_px);
  }
  if (placement.inliers < options.min_resection_inliers) return {};
  if (placement.inliers < kMinInlierShare * static_cast<double>(n)) return {};
  return placement;
}

struct Resector::Impl {
  using Shared = std::shared_ptr<const AlignImage>;
  const FrameSource& frames;
  AlignOptions align_options;
  BundleOptions options;
  std::uint64_t seed;
  AlignField field;
  // No point starts in the frame to be placed: its reflections need not be known.
  cv::Mat no_reflections;
  Cache<Shared> references{kReferencesHeld};

  Shared reference(int frame) {
    return references.get(frame, [&] {
      return std::make_shared<const AlignImage>(prepare_alignment(frames.pose_frame(frame), field));
    });
  }

  // The nearer key frame is asked first.
  template <typename PointsOf>
  std::optional<Rigid3> place(const Structure& structure, const std::vector<int>& placed, int frame,
                              const PointsOf& points_of) {
    const AlignImage moving =
        prepare_alignment({frame, frames.gray(frame), {}, no_reflections, frames.valid()}, field);
    const Between around = between(structure, placed, frame);
    for (const int k : around.keyframes) {
      const std::vector<Seen>& points = points_of(k);
      if (static_cast<int>(points.size()) < kMinPoints) continue;
      const Sighted sighted = follow(frames.lens(), points, *reference(structure.frames[k]), moving,
                                     around.cam_from_world, align_options, seed);
      const auto found = place_by_points(sighted.points, sighted.rays, frames.lens().fx, options);
      if (found) return found->cam_from_world;
    }
    return std::nullopt;
  }
};

Resector::Resector(const FrameSource& frames, const AlignOptions& align_options,
                   const BundleOptions& options, std::uint64_t seed)
    : impl_(new Impl{frames, align_options, options, seed,
                     prepare_field(frames.valid(), align_options),
                     cv::Mat::zeros(frames.valid().size(), CV_8U)}) {}
Resector::~Resector() = default;

std::optional<Rigid3> Resector::place(const Structure& structure, int frame) const {
  const std::vector<int> placed = placed_keyframes(structure);
  if (placed.empty()) return std::nullopt;
  return impl_->place(structure, placed, frame,
                      [&](int k) { return points_seen_by(structure, k); });
}

std::vector<std::optional<Rigid3>> resect_frames(const FrameSource& frames,
                                                 const Structure& structure,
                                                 const AlignOptions& align_options,
                                                 const BundleOptions& options, std::uint64_t seed,
                                                 Progress& progress) {
  const int n = frames.size();
  std::vector<std::optional<Rigid3>> poses = keyframe_poses(structure, n);
  const std::vector<int> rest = without_pose(poses), placed = placed_keyframes(structure);
  progress.begin("resection", rest.size());
  if (placed.empty()) {
    progress.end("nothing to place frames in");
    return poses;
  }
  const std::vector<std::vector<Seen>> seen = points_seen(structure);
  const Resector resector(frames, align_options, options, seed);
  do_in_lots(rest.size(), kFramesAtOnce, progress, [&](std::size_t i) {
    poses[rest[i]] = resector.impl_->place(
        structure, placed, rest[i], [&](int k) -> const auto& { return seen[k]; });
  });
  const auto lost =
      std::count_if(poses.begin(), poses.end(), [](const auto& pose) { return !pose; });
  progress.end(fmt::format("{} of {} frames placed, {} lost", n - lost, n, lost));
  return poses;
}

}  // namespace rugae
