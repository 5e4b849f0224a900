#include "recon/dense/view_choice.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/units.h"

namespace rugae {
namespace {

constexpr double kBestAngleRad = 5.0 * kPi / 180.0;
constexpr double kSigmaBelowRad = 2.0 * kPi / 180.0, kSigmaAboveRad = 8.0 * kPi / 180.0;
/// A source adds at least this much, counted in points seen at the best angle.
constexpr double kMinSourceGain = 5.0;
constexpr std::size_t kMinSources = 2;
/// A depth map must add this share of what the first one added.
constexpr double kMinMapGain = 0.02;

struct Seen {
  int track;
  double distance;   // camera to point
  Vec3 towards_cam;  // unit, from the point, world
};

/// Of each key frame, the points it sees.
std::vector<std::vector<Seen>> seen_by(const Structure& structure) {
  std::vector<std::vector<Seen>> seen(structure.frames.size());
  std::vector<Vec3> centres(structure.frames.size(), Vec3::Zero());
  for (std::size_t k = 0; k < centres.size(); ++k)
    if (structure.placed[k]) centres[k] = structure.cam_from_world[k].inverse().translation;
  for (std::size_t t = 0; t < structure.tracks.size(); ++t) {
    if (!structure.tracks[t].triangulated) continue;
    for (const Track::Observation& o : structure.tracks[t].observations) {
      if (!structure.placed[o.keyframe]) continue;
      const Vec3 away = centres[o.keyframe] - structure.tracks[t].point;
      const double distance = away.norm();
      if (distance > 0.0)
        seen[o.keyframe].push_back({static_cast<int>(t), distance, away / distance});
    }
  }
  return seen;
}

std::vector<int> sources_of(int reference, const std::vector<std::vector<Seen>>& seen,
                            const std::vector<std::vector<std::pair<int, int>>>& seers,
                            std::size_t wanted) {
  // What each other key frame is worth at each point that both see, points in the reference's
  // order.
  std::map<int, std::vector<std::pair<int, double>>> worth;
  const std::vector<Seen>& mine = seen[reference];
  for (std::size_t i = 0; i < mine.size(); ++i)
    for (const auto& [other, place] : seers[mine[i].track]) {
      if (other == reference) continue;
      const Seen& theirs = seen[other][place];
      const double cosine = std::clamp(mine[i].towards_cam.dot(theirs.towards_cam), -1.0, 1.0);
      const double scale =
          std::min(mine[i].distance, theirs.distance) / std::max(mine[i].distance, theirs.distance);
      worth[other].emplace_back(static_cast<int>(i),
                                scale * triangulation_weight(std::acos(cosine)));
    }
  std::vector<double> have(mine.size(), 0.0);  // worth of the sources so far
  std::vector<int> sources;
  while (sources.size() < wanted) {
    int best = -1;
    double best_gain = kMinSourceGain;
    for (const auto& [other, points] : worth) {
      double gain = 0.0;
      for (const auto& [point, value] : points) gain += value / (1.0 + have[point]);
      if (gain > best_gain) best = other, best_gain = gain;
    }
    if (best < 0) break;
    for (const auto& [point, value] : worth[best]) have[point] += value;
    worth.erase(best);
    sources.push_back(best);
  }
  return sources;
}

}  // namespace

double triangulation_weight(double angle_rad) {
  const double sigma = angle_rad < kBestAngleRad ? kSigmaBelowRad : kSigmaAboveRad;
  const double off = (angle_rad - kBestAngleRad) / sigma;
  return std::exp(-0.5 * off * off);
}

std::vector<StereoSet> choose_views(const Structure& structure, const DenseOptions& options) {
  const auto seen = seen_by(structure);
  std::vector<std::vector<std::pair<int, int>>> seers(structure.tracks.size());
  for (std::size_t k = 0; k < seen.size(); ++k)
    for (std::size_t i = 0; i < seen[k].size(); ++i)
      seers[seen[k][i].track].emplace_back(static_cast<int>(k), static_cast<int>(i));

  std::vector<int> missing(structure.tracks.size(), options.depth_maps_a_point);
  std::vector<bool> taken(seen.size(), false);
  std::vector<StereoSet> sets;
  double first_gain = 0.0;
  while (static_cast<int>(sets.size()) < options.max_depth_maps) {
    int best = -1;
    double best_gain = 0.0;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (taken[k]) continue;
      double gain = 0.0;
      // What is short of several depth maps counts more than what is short of one.
      for (const Seen& point : seen[k]) gain += missing[point.track];
      if (gain > best_gain) best = static_cast<int>(k), best_gain = gain;
    }
    if (best < 0 || best_gain < kMinMapGain * first_gain) break;
    taken[best] = true;
    StereoSet set{best, sources_of(best, seen, seers, static_cast<std::size_t>(options.views))};
    if (set.sources.size() < kMinSources) continue;
    first_gain = std::max(first_gain, best_gain);
    for (const Seen& point : seen[best])
      missing[point.track] = std::max(0, missing[point.track] - 1);
    sets.push_back(std::move(set));
  }
  std::ranges::sort(sets, {}, &StereoSet::reference);
  return sets;
}

}  // namespace rugae
