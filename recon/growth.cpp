#include "recon/growth.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "recon/bundle.h"
#include "recon/resection.h"
#include "recon/triangulation.h"
#include "recon/two_view.h"

namespace rugae {
namespace {

constexpr double kTwoViewHubers = 1.5;  // RANSAC threshold of the start, times huber_px
constexpr double kOutlierHubers = 4.0;  // observations further off than this do not belong
constexpr int kStartWindow = 12;        // key frames a starting pair may be apart
constexpr int kStartsLookedAt = 12;     // first key frames of starting pairs
constexpr int kStartsTried = 6;         // pairs whose relative pose is estimated
constexpr int kStartsTriedInVain = 24;  // ... while none has been found
constexpr double kGoodMotionPx = 60.0;  // more motion than this does not rank a pair higher
constexpr int kMinStartInliers = 40;
constexpr double kGoodParallaxRad = 0.06;  // more than this adds nothing to a start: 3.4 degrees
constexpr int kLocalKeyframes = 6;         // adjusted after each placement
constexpr double kGlobalGrowth = 1.25;     // all are adjusted when their number grew by this
constexpr int kLocalIterations = 6;
constexpr int kGlobalIterations = 12;

std::vector<Sight> sights_of(const Structure& s, const Track& track, bool inliers_only,
                             std::vector<std::size_t>* which = nullptr) {
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < track.observations.size(); ++i) {
    const auto& o = track.observations[i];
    if (!s.placed[o.keyframe] || (inliers_only && !o.inlier)) continue;
    sights.push_back({s.cam_from_world[o.keyframe], o.ray});
    if (which != nullptr) which->push_back(i);
  }
  return sights;
}

void triangulate_track(const Structure& s, Track& track, double focal_px, double max_px,
                       const BundleOptions& options) {
  std::vector<std::size_t> which;
  const std::vector<Sight> sights = sights_of(s, track, false, &which);
  track.triangulated = false;
  if (sights.size() < 2) return;
  const auto robust = triangulate_robust(sights, max_px / focal_px, options.min_parallax_rad);
  if (!robust) return;
  track.point = robust->point;
  track.triangulated = true;
  for (std::size_t i = 0; i < which.size(); ++i)
    track.observations[which[i]].inlier = robust->inlier[i];
}

struct Shared {
  std::vector<Vec2> first, second;
  std::vector<std::size_t> tracks;
};

// Tracks that both key frames see.
Shared shared_tracks(const Structure& s, const SeenTracks& seen, int first, int second) {
  Shared shared;
  for (const std::size_t t : seen[static_cast<std::size_t>(first)]) {
    const Track::Observation *a = nullptr, *b = nullptr;
    for (const auto& o : s.tracks[t].observations) {
      if (o.keyframe == first) a = &o;
      if (o.keyframe == second) b = &o;
    }
    if (a == nullptr || b == nullptr) continue;
    shared.first.push_back(a->ray);
    shared.second.push_back(b->ray);
    shared.tracks.push_back(t);
  }
  return shared;
}

struct Start {
  int first = -1, second = -1;
  TwoView view;
  Shared shared;
};

// Median motion of the shared tracks between two key frames, px: parallax cannot be larger.
double median_motion_px(const Shared& shared, double focal_px) {
  std::vector<double> motions;
  for (std::size_t i = 0; i < shared.first.size(); ++i)
    motions.push_back(focal_px * (shared.second[i] - shared.first[i]).norm());
  const auto middle = motions.begin() + static_cast<std::ptrdiff_t>(motions.size() / 2);
  std::nth_element(motions.begin(), middle, motions.end());
  return *middle;
}

// The pair whose inliers and parallax together are best: many points, seen from places far enough
// apart that their depth is known. Pairs are ranked by what they share and how far it moved, and
// only the first of them are looked at closely.
std::optional<Start> best_start(const Structure& s, const std::vector<char>& available,
                                double focal_px, const BundleOptions& options) {
  const SeenTracks seen = seen_tracks(s);
  std::vector<int> keys;
  for (int k = 0; k < static_cast<int>(available.size()); ++k)
    if (available[k]) keys.push_back(k);
  struct Ranked {
    double score;
    int first, second;
  };
  std::vector<Ranked> ranked;
  // First members are spread over the segment, so that one bad stretch cannot spoil the start.
  const int n = static_cast<int>(keys.size());
  const int stride = std::max(1, (n - 1) / kStartsLookedAt);
  for (int i = 0; i + 1 < n; i += stride) {
    for (int j = i + 1; j < n && keys[j] <= keys[i] + kStartWindow; ++j) {
      const Shared shared = shared_tracks(s, seen, keys[i], keys[j]);
      if (static_cast<int>(shared.tracks.size()) < kMinStartInliers) break;
      const double motion = std::min(1.0, median_motion_px(shared, focal_px) / kGoodMotionPx);
      ranked.push_back({motion * static_cast<double>(shared.tracks.size()), keys[i], keys[j]});
    }
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.score > b.score; });
  std::optional<Start> best;
  double best_score = 0.0;
  int tried = 0;
  for (const Ranked& pair : ranked) {
    if (++tried > (best ? kStartsTried : kStartsTriedInVain)) break;
    Shared shared = shared_tracks(s, seen, pair.first, pair.second);
    auto view = two_view(shared.first, shared.second, focal_px, kTwoViewHubers * options.huber_px);
    if (!view || view->inliers < kMinStartInliers) continue;
    if (!(view->median_parallax_rad >= options.min_parallax_rad)) continue;
    const double share = view->inliers / static_cast<double>(shared.tracks.size());
    const double score =
        view->inliers * share * std::min(view->median_parallax_rad, kGoodParallaxRad);
    if (score <= best_score) continue;
    best_score = score;
    best = Start{pair.first, pair.second, std::move(*view), std::move(shared)};
  }
  return best;
}

// Known points that a key frame sees.
void known_points(const Structure& s, const SeenTracks& seen, int keyframe,
                  std::vector<Vec3>& points, std::vector<Vec2>& rays) {
  for (const std::size_t t : seen[static_cast<std::size_t>(keyframe)]) {
    const Track& track = s.tracks[t];
    if (!track.triangulated) continue;
    for (const auto& o : track.observations) {
      if (o.keyframe != keyframe) continue;
      points.push_back(track.point);
      rays.push_back(o.ray);
    }
  }
}

// The placed key frames that share most points with `keyframe`, and itself.
std::vector<int> neighbourhood(const Structure& s, const SeenTracks& seen, int keyframe) {
  std::vector<int> shared(s.frames.size(), 0);
  for (const std::size_t t : seen[static_cast<std::size_t>(keyframe)]) {
    const Track& track = s.tracks[t];
    if (!track.triangulated) continue;
    const bool sees =
        std::any_of(track.observations.begin(), track.observations.end(),
                    [&](const auto& o) { return o.keyframe == keyframe && o.inlier; });
    if (!sees) continue;
    for (const auto& o : track.observations) shared[o.keyframe] += s.placed[o.keyframe] && o.inlier;
  }
  std::vector<int> order;
  for (int k = 0; k < static_cast<int>(shared.size()); ++k)
    if (shared[k] > 0) order.push_back(k);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return shared[a] > shared[b]; });
  if (static_cast<int>(order.size()) > kLocalKeyframes) order.resize(kLocalKeyframes);
  return order;
}

// Known points that each key frame sees.
std::vector<int> known_counts(const Structure& s, const SeenTracks& seen) {
  std::vector<int> counts(s.frames.size(), 0);
  for (std::size_t k = 0; k < counts.size(); ++k)
    counts[k] = static_cast<int>(
        std::ranges::count_if(seen[k], [&](std::size_t t) { return s.tracks[t].triangulated; }));
  return counts;
}

// One point more for each key frame that sees it.
void count(const Track& track, std::vector<int>& counts) {
  int last = -1;
  for (const auto& o : track.observations)
    if (std::exchange(last, o.keyframe) != o.keyframe) ++counts[o.keyframe];
}

// New points are counted.
void triangulate_seen(Structure& s, const SeenTracks& seen, int keyframe, double focal_px,
                      double max_px, const BundleOptions& options, std::vector<int>& counts) {
  for (const std::size_t t : seen[static_cast<std::size_t>(keyframe)]) {
    Track& track = s.tracks[t];
    for (auto& o : track.observations) {
      if (o.keyframe != keyframe) continue;
      if (track.triangulated) {
        o.inlier =
            reprojection_px(s.cam_from_world[keyframe], track.point, o.ray, focal_px) <= max_px;
      } else {
        triangulate_track(s, track, focal_px, max_px, options);
        if (track.triangulated) count(track, counts);
      }
      break;
    }
  }
}

void begin_with(Structure& s, const Start& start, const BundleOptions& options) {
  s.placed[start.first] = s.placed[start.second] = true;
  s.cam_from_world[start.first] = Rigid3{};
  s.cam_from_world[start.second] = start.view.second_from_first;
  for (std::size_t i = 0; i < start.shared.tracks.size(); ++i) {
    if (!start.view.inlier[i]) continue;
    Track& track = s.tracks[start.shared.tracks[i]];
    const std::vector<Sight> sights = sights_of(s, track, false);
    if (!(parallax_rad(sights, start.view.points[i]) >= options.min_parallax_rad)) continue;
    track.point = start.view.points[i];
    track.triangulated = true;
  }
}

}  // namespace

void update_points(Structure& structure, double focal_px, double max_px,
                   const BundleOptions& options) {
  for (Track& track : structure.tracks) {
    if (track.triangulated) {
      for (auto& o : track.observations)
        if (structure.placed[o.keyframe])
          o.inlier = reprojection_px(structure.cam_from_world[o.keyframe], track.point, o.ray,
                                     focal_px) <= max_px;
      const std::vector<Sight> sights = sights_of(structure, track, true);
      track.triangulated =
          sights.size() >= 2 && parallax_rad(sights, track.point) >= options.min_parallax_rad;
    }
    if (!track.triangulated) triangulate_track(structure, track, focal_px, max_px, options);
  }
}

void adjust_all(Structure& structure, double focal_px, const BundleOptions& options, int rounds,
                double function_tolerance) {
  const double max_px = kOutlierHubers * options.huber_px;
  BundleScope scope;
  scope.max_iterations = options.max_iterations;
  scope.function_tolerance = function_tolerance;
  for (int round = 0; round < rounds; ++round) {
    const BundleReport report = bundle_adjust(structure, focal_px, options, scope);
    structure.iterations = report.iterations;
    structure.converged = report.converged;
    scope.radius = report.radius;  // the next round begins where this one ended
    update_points(structure, focal_px, max_px, options);
  }
}

SegmentGrowth::SegmentGrowth(Structure& structure, double focal_px, const BundleOptions& options)
    : structure_(structure), focal_px_(focal_px), options_(options) {}

bool SegmentGrowth::begin(const std::vector<char>& available) {
  const auto start = best_start(structure_, available, focal_px_, options_);
  if (!start) return false;
  begin_with(structure_, *start, options_);
  placed_ = 2;
  adjust_globally();
  return true;
}

void SegmentGrowth::adjust_globally() {
  BundleScope global;
  global.max_iterations = kGlobalIterations;
  global.function_tolerance = 1e-4;
  bundle_adjust(structure_, focal_px_, options_, global);
  update_points(structure_, focal_px_, kOutlierHubers * options_.huber_px, options_);
  placed_at_global_ = placed_;
}

void SegmentGrowth::extend(const std::vector<char>& available, Progress& progress) {
  Structure& s = structure_;
  const double max_px = kOutlierHubers * options_.huber_px;
  const SeenTracks seen = seen_tracks(s);
  tried_.resize(s.frames.size(), 0);
  std::vector<int> counts = known_counts(s, seen);
  for (;;) {
    int next = -1;
    for (int k = 0; k < static_cast<int>(counts.size()); ++k) {
      if (!available[k] || s.placed[k]) continue;
      if (counts[k] < options_.min_resection_inliers || counts[k] <= tried_[k]) continue;
      if (next < 0 || counts[k] > counts[next]) next = k;
    }
    if (next < 0) break;
    std::vector<Vec3> points;
    std::vector<Vec2> rays;
    known_points(s, seen, next, points, rays);
    const auto placement = place_by_points(points, rays, focal_px_, options_);
    if (!placement) {
      tried_[next] = counts[next];
      continue;
    }
    s.placed[next] = true;
    s.cam_from_world[next] = placement->cam_from_world;
    ++placed_;
    progress.step();
    triangulate_seen(s, seen, next, focal_px_, max_px, options_, counts);
    if (placed_ >= kGlobalGrowth * placed_at_global_) {
      adjust_globally();
      counts = known_counts(s, seen);
    } else {
      BundleScope local;
      local.free_keyframes = neighbourhood(s, seen, next);
      local.seen = &seen;
      local.max_iterations = kLocalIterations;
      local.function_tolerance = 1e-3;
      bundle_adjust(s, focal_px_, options_, local);
    }
  }
}

bool grow_segment(Structure& structure, const std::vector<char>& available, double focal_px,
                  const BundleOptions& options, Progress& progress) {
  SegmentGrowth growth(structure, focal_px, options);
  if (!growth.begin(available)) return false;
  progress.step(2);
  growth.extend(available, progress);
  return true;
}

}  // namespace rugae
