#include "recon/track_chain.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace rugae {
namespace {

// Occupied cells of side `spacing`: a point is taken when another lies within `spacing` of it.
class Occupied {
 public:
  explicit Occupied(double spacing) : spacing_(spacing) {}
  bool taken(const Vec2& p) const {
    const auto [cx, cy] = cell(p);
    for (int y = cy - 1; y <= cy + 1; ++y)
      for (int x = cx - 1; x <= cx + 1; ++x) {
        const auto found = cells_.find(key(x, y));
        if (found == cells_.end()) continue;
        for (const Vec2& q : found->second)
          if ((q - p).norm() < spacing_) return true;
      }
    return false;
  }
  void add(const Vec2& p) {
    const auto [cx, cy] = cell(p);
    cells_[key(cx, cy)].push_back(p);
  }

 private:
  std::pair<int, int> cell(const Vec2& p) const {
    return {static_cast<int>(std::floor(p.x() / spacing_)),
            static_cast<int>(std::floor(p.y() / spacing_))};
  }
  static std::int64_t key(int x, int y) { return (static_cast<std::int64_t>(y) << 32) + x; }
  double spacing_;
  std::unordered_map<std::int64_t, std::vector<Vec2>> cells_;
};

}  // namespace

std::vector<Vec2> TrackChain::starts(int frame, const std::vector<Vec2>& fresh, double spacing_px) {
  std::vector<int>& through = through_[frame];
  Occupied occupied(spacing_px);
  std::vector<Vec2> points;
  for (const int t : through) {
    points.push_back(tracks_[t].observations.back().pixel);
    for (const auto& o : tracks_[t].observations)
      if (o.keyframe == frame) points.back() = o.pixel;
    occupied.add(points.back());
  }
  for (const Vec2& p : fresh) {
    if (occupied.taken(p)) continue;
    occupied.add(p);
    Track track;
    track.observations.push_back({frame, p});
    through.push_back(static_cast<int>(tracks_.size()));
    tracks_.push_back(std::move(track));
    points.push_back(p);
  }
  started_ = through;
  return points;
}

void TrackChain::add(int moving, const std::vector<int>& point_index,
                     const std::vector<Vec2>& moving_px, double spacing_px) {
  // Two tracks that ran together are one point seen twice: the second is not continued.
  Occupied occupied(0.25 * spacing_px);
  for (const int t : through_[moving])
    for (const auto& o : tracks_[t].observations)
      if (o.keyframe == moving) occupied.add(o.pixel);
  for (std::size_t i = 0; i < point_index.size(); ++i) {
    const int t = started_[point_index[i]];
    Track& track = tracks_[t];
    const bool known = std::any_of(track.observations.begin(), track.observations.end(),
                                   [&](const auto& o) { return o.keyframe == moving; });
    if (known || occupied.taken(moving_px[i])) continue;
    occupied.add(moving_px[i]);
    track.observations.push_back({moving, moving_px[i]});
    through_[moving].push_back(t);
  }
}

const std::vector<int>& TrackChain::through(int frame) const {
  static const std::vector<int> kNone;
  const auto found = through_.find(frame);
  return found == through_.end() ? kNone : found->second;
}

std::vector<Track> TrackChain::finish() {
  std::erase_if(tracks_, [](const Track& t) { return t.observations.size() < 2; });
  for (Track& track : tracks_)
    std::sort(track.observations.begin(), track.observations.end(),
              [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
  return std::move(tracks_);
}

}  // namespace rugae
