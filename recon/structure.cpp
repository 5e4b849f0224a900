#include "recon/structure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/sim3.h"
#include "recon/bundle.h"
#include "recon/growth.h"

namespace rugae {
namespace {

constexpr int kMinSegment = 3;               // key frames: two views alone check nothing
constexpr int kMinJoiningPoints = 12;        // points that two segments share
constexpr double kJoiningShare = 0.5;        // of them must agree
constexpr double kJoiningDepthShare = 0.05;  // to this share of their distance from the camera
constexpr int kJoinRounds = 10;              // of fitting and rejecting

// One segment as it was grown: poses and points of its own world.
struct Segment {
  std::vector<bool> placed;
  std::vector<Rigid3> cam_from_world;
  std::vector<Vec3> points;
  std::vector<char> has_point;
  std::vector<std::vector<char>> inliers;  // of each track's observations
  int count = 0;
};

Segment taken_from(const Structure& s) {
  Segment segment{s.placed, s.cam_from_world, {}, {}, {}, s.placed_count()};
  for (const Track& track : s.tracks) {
    segment.points.push_back(track.point);
    segment.has_point.push_back(track.triangulated);
    std::vector<char>& inliers = segment.inliers.emplace_back();
    for (const auto& o : track.observations) inliers.push_back(o.inlier);
  }
  return segment;
}

// Similarity a_from_b from the points that both segments have, fitted and trimmed: each round keeps
// the points that agree better than the median (at first) or the tolerance.
std::optional<Sim3> join(const Segment& a, const Segment& b) {
  std::vector<Vec3> in_a, in_b;
  Vec3 centre_a = Vec3::Zero();
  int cameras = 0;
  for (std::size_t k = 0; k < a.placed.size(); ++k)
    if (a.placed[k]) centre_a += a.cam_from_world[k].inverse().translation, ++cameras;
  centre_a /= std::max(1, cameras);
  for (std::size_t t = 0; t < a.points.size(); ++t) {
    if (!a.has_point[t] || !b.has_point[t]) continue;
    in_a.push_back(a.points[t]);
    in_b.push_back(b.points[t]);
  }
  const std::size_t n = in_a.size();
  if (n < kMinJoiningPoints) return std::nullopt;
  std::vector<char> keep(n, 1);
  std::optional<Sim3> a_from_b;
  std::size_t kept = n;
  for (int round = 0; round < kJoinRounds; ++round) {
    std::vector<Vec3> source, target;
    for (std::size_t i = 0; i < n; ++i) {
      if (!keep[i]) continue;
      source.push_back(in_b[i]);
      target.push_back(in_a[i]);
    }
    a_from_b = umeyama(source, target, true);
    if (!a_from_b) return std::nullopt;
    std::vector<double> errors(n);
    for (std::size_t i = 0; i < n; ++i)
      errors[i] = (*a_from_b * in_b[i] - in_a[i]).norm() / (in_a[i] - centre_a).norm();
    std::vector<double> sorted = errors;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(n / 2),
                     sorted.end());
    const double limit =
        std::max(kJoiningDepthShare, round < kJoinRounds / 2 ? sorted[n / 2] : 0.0);
    kept = 0;
    for (std::size_t i = 0; i < n; ++i) kept += keep[i] = errors[i] <= limit;
    if (kept < kMinJoiningPoints) return std::nullopt;
  }
  if (!(static_cast<double>(kept) >= kJoiningShare * static_cast<double>(n))) return std::nullopt;
  return a_from_b;
}

// Moves segment b into a's world. cam_from_b = cam_from_a a_from_b: with X_b = S^-1 X_a the camera
// sees s R_c (S^-1 X_a) + s t_c, the same rays.
void merge(Segment& a, const Segment& b, const Sim3& a_from_b, const std::vector<Track>& tracks) {
  std::vector<char> moved(b.placed.size(), 0);  // key frames
  for (std::size_t k = 0; k < b.placed.size(); ++k) {
    if (!b.placed[k] || a.placed[k]) continue;
    moved[k] = 1;
    a.placed[k] = true;
    a.cam_from_world[k] = (a_from_b * b.cam_from_world[k].inverse()).inverse();
    ++a.count;
  }
  for (std::size_t t = 0; t < b.points.size(); ++t) {
    if (!b.has_point[t] || a.has_point[t]) continue;
    a.points[t] = a_from_b * b.points[t];
    a.has_point[t] = 1;
  }
  // What b's key frames saw was judged by b's points; a's lie elsewhere, if only by a little.
  for (std::size_t t = 0; t < tracks.size(); ++t)
    for (std::size_t i = 0; i < tracks[t].observations.size(); ++i) {
      const int k = tracks[t].observations[i].keyframe;
      if (moved[static_cast<std::size_t>(k)])
        a.inliers[t][i] = b.inliers[t][i] && (a.cam_from_world[k] * a.points[t]).z() > 0.0;
    }
}

std::vector<Segment> grow_all(Structure& s, double focal_px, const BundleOptions& options,
                              Progress& progress) {
  const std::size_t n = s.frames.size();
  std::vector<char> available(n, 1);
  std::vector<Segment> segments;
  for (;;) {
    s.placed.assign(n, false);
    s.cam_from_world.assign(n, Rigid3{});
    for (Track& track : s.tracks) {
      track.triangulated = false;
      for (auto& o : track.observations) o.inlier = true;
    }
    if (!grow_segment(s, available, focal_px, options, progress)) break;
    segments.push_back(taken_from(s));
    for (std::size_t k = 0; k < n; ++k)
      if (s.placed[k]) available[k] = 0;
    if (std::count(available.begin(), available.end(), 1) < kMinSegment) break;
  }
  return segments;
}

// Joins what can be joined to the largest segment, which comes first.
void join_to_largest(std::vector<Segment>& segments, const std::vector<Track>& tracks) {
  std::stable_sort(segments.begin(), segments.end(),
                   [](const Segment& a, const Segment& b) { return a.count > b.count; });
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 1; i < segments.size(); ++i) {
      const auto whole_from_other = join(segments[0], segments[i]);
      if (!whole_from_other) continue;
      merge(segments[0], segments[i], *whole_from_other, tracks);
      segments.erase(segments.begin() + static_cast<std::ptrdiff_t>(i));
      changed = true;
      break;
    }
  }
}

// Of `all` that one segment placed, with what its key frames see.
Structure structure_of(const Segment& segment, const Structure& all) {
  Structure s;
  s.frames = all.frames;
  s.placed = segment.placed;
  s.cam_from_world = segment.cam_from_world;
  for (std::size_t t = 0; t < all.tracks.size(); ++t) {
    Track track = all.tracks[t];
    for (std::size_t i = 0; i < track.observations.size(); ++i)
      track.observations[i].inlier = segment.inliers[t][i] != 0;
    std::erase_if(track.observations, [&](const auto& o) { return !segment.placed[o.keyframe]; });
    if (track.observations.size() < 2) continue;
    track.point = segment.points[t];
    track.triangulated = segment.has_point[t] != 0;
    s.tracks.push_back(std::move(track));
  }
  return s;
}

}  // namespace

int Structure::placed_count() const {
  return static_cast<int>(std::count(placed.begin(), placed.end(), true));
}

SeenTracks seen_tracks(const Structure& s) {
  SeenTracks seen(s.frames.size());
  for (std::size_t t = 0; t < s.tracks.size(); ++t) {
    for (const auto& o : s.tracks[t].observations) {
      std::vector<std::size_t>& of = seen[static_cast<std::size_t>(o.keyframe)];
      if (of.empty() || of.back() != t) of.push_back(t);
    }
  }
  return seen;
}

void normalise(Structure& s) {
  const auto first = std::find(s.placed.begin(), s.placed.end(), true);
  if (first == s.placed.end()) return;
  const auto k = static_cast<int>(first - s.placed.begin());
  const Rigid3 new_from_old = s.cam_from_world[k];
  std::vector<double> depths;
  for (const Track& track : s.tracks) {
    if (!track.triangulated) continue;
    for (const auto& o : track.observations)
      if (o.keyframe == k && o.inlier) depths.push_back((new_from_old * track.point).z());
  }
  double scale = 1.0;
  if (!depths.empty()) {
    const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    scale = 1.0 / *middle;
  }
  const Sim3 moved{scale, new_from_old.rotation, scale * new_from_old.translation};
  for (std::size_t i = 0; i < s.frames.size(); ++i)
    if (s.placed[i]) s.cam_from_world[i] = (moved * s.cam_from_world[i].inverse()).inverse();
  s.cam_from_world[k] = Rigid3{};
  for (Track& track : s.tracks) track.point = moved * track.point;
}

void rescale(Structure& s, double factor) {
  for (Rigid3& pose : s.cam_from_world) pose.translation *= factor;
  for (Track& track : s.tracks) track.point *= factor;
}

void remove_outliers(Structure& s) {
  for (Track& track : s.tracks)
    std::erase_if(track.observations,
                  [&](const auto& o) { return !o.inlier || !s.placed[o.keyframe]; });
  std::erase_if(s.tracks, [](const Track& track) { return !track.triangulated; });
}

void settle_structure(Structure& s, double focal_px) {
  remove_outliers(s);
  normalise(s);
  double sum = 0.0;
  std::size_t count = 0;
  for (const Track& track : s.tracks) {
    for (const auto& o : track.observations) {
      sum += reprojection_px(s.cam_from_world[o.keyframe], track.point, o.ray, focal_px);
      ++count;
    }
  }
  s.mean_reprojection_px = count > 0 ? sum / static_cast<double>(count) : 0.0;
}

void finish_structure(Structure& s, const Lens& lens, const BundleOptions& options,
                      const Adjustment& adjustment, Progress& progress) {
  progress.begin("bundle adjustment");
  adjust_all(s, lens.fx, options, adjustment.rounds, adjustment.function_tolerance);
  settle_structure(s, lens.fx);
  progress.end(fmt::format("{} points, {:.3f} px", s.tracks.size(), s.mean_reprojection_px));
}

std::vector<Structure> build_segments(const std::vector<int>& frames, std::vector<Track> tracks,
                                      const Lens& lens, const BundleOptions& options,
                                      Progress& progress) {
  const std::size_t n = frames.size();
  Structure s;
  s.frames = frames;
  s.tracks = std::move(tracks);
  progress.begin("structure", n);
  std::vector<Segment> segments = grow_all(s, lens.fx, options, progress);
  const std::size_t grown = segments.size();
  if (segments.empty()) {
    s.placed.assign(n, false);
    s.cam_from_world.assign(n, Rigid3{});
    s.tracks.clear();
    progress.end("nothing could be placed");
    return {std::move(s)};
  }
  join_to_largest(segments, s.tracks);
  std::vector<Structure> structures;
  for (const Segment& segment : segments) structures.push_back(structure_of(segment, s));
  progress.end(
      fmt::format("{} of {} key frames, {} segments", structures[0].placed_count(), n, grown));
  return structures;
}

Structure build_structure(const std::vector<int>& frames, std::vector<Track> tracks,
                          const Lens& lens, const BundleOptions& options,
                          const Adjustment& adjustment, Progress& progress) {
  Structure s =
      std::move(build_segments(frames, std::move(tracks), lens, options, progress).front());
  if (s.placed_count() > 0) finish_structure(s, lens, options, adjustment, progress);
  return s;
}

}  // namespace rugae
