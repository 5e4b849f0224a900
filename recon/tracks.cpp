#include "recon/tracks.h"

#include <fmt/format.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <unordered_map>

#include "core/random.h"
#include "recon/flow_guess.h"
#include "recon/look_back.h"

namespace rugae {
namespace {

constexpr double kReferenceWidth = 640.0;  // pixel options are meant at this width
constexpr double kCornerQuality = 0.002;  // of the best corner: weak texture counts, noise does not
constexpr int kCornerBlock = 7;           // px
// Of the points of a key frame, those found in the next: three quarters as a rule, less than this
// where the next comes too late.
constexpr double kMinFollowedShare = 0.5;
constexpr int kBorder = 8;                // px: no corner nearer to where the image ends
constexpr int kMoreRounds = 2;            // of following again, where few points were found
constexpr std::size_t kLookedBackAt = 3;  // earlier key frames, where the chain broke

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

// A frame with its corners, as far as both are known ahead of their turn.
struct Prepared {
  AlignImage image;
  std::vector<Vec2> corners;
};

// Corners in order of strength, (0.5, 0.5) convention.
std::vector<Vec2> corners(const Frame& frame, double spacing_px) {
  cv::Mat mask;
  cv::bitwise_and(frame.valid, ~frame.reflection, mask);
  cv::erode(mask, mask,
            cv::getStructuringElement(cv::MORPH_RECT, {2 * kBorder + 1, 2 * kBorder + 1}), {-1, -1},
            1, cv::BORDER_CONSTANT, cv::Scalar(0));
  std::vector<cv::Point2f> found;
  cv::goodFeaturesToTrack(frame.gray, found, 0, kCornerQuality, spacing_px, mask, kCornerBlock);
  std::vector<Vec2> points;
  points.reserve(found.size());
  for (const cv::Point2f& p : found) points.emplace_back(p.x + 0.5, p.y + 0.5);
  return points;
}

// Observations by frame index become observations by position among the key frames.
void number_keyframes(std::vector<Track>& tracks, const std::vector<int>& keyframes) {
  for (Track& track : tracks)
    for (Track::Observation& o : track.observations)
      o.keyframe =
          static_cast<int>(std::ranges::lower_bound(keyframes, o.keyframe) - keyframes.begin());
}

}  // namespace

std::optional<Vec2> ray_of(const Lens& lens, const Vec2& pixel) {
  const auto direction = lens.unproject(pixel);
  if (!direction || !(direction->z() > 0.0)) return std::nullopt;
  return Vec2(direction->head<2>() / direction->z());
}

std::uint64_t pair_seed(std::uint64_t seed, int reference, int moving) {
  const auto words =
      random_words(seed, Purpose::recon_ransac, static_cast<std::uint32_t>(reference),
                   static_cast<std::uint64_t>(moving));
  return (static_cast<std::uint64_t>(words[1]) << 32) | words[0];
}

void set_rays(std::vector<Track>& tracks, const Lens& lens) {
  for (Track& track : tracks) {
    std::erase_if(track.observations, [&](Track::Observation& o) {
      const auto ray = ray_of(lens, o.pixel);
      if (ray) o.ray = *ray;
      return !ray;
    });
  }
}

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

std::vector<Track> TrackChain::finish() {
  std::erase_if(tracks_, [](const Track& t) { return t.observations.size() < 2; });
  for (Track& track : tracks_)
    std::sort(track.observations.begin(), track.observations.end(),
              [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
  return std::move(tracks_);
}

Followed follow_tracks(const FrameSource& frames, const Keyframes& keyframes,
                       const AlignOptions& align_options, const TrackOptions& options,
                       std::uint64_t seed, Progress& progress) {
  const double spacing_px = options.spacing_px * frames.lens().width / kReferenceWidth;
  progress.begin("pairwise alignment", keyframes.frames.size());
  Followed followed;
  std::vector<int>& at = followed.keyframes;
  at = keyframes.frames;
  const AlignField field = prepare_field(frames.valid(), align_options);
  std::map<int, Prepared> prepared;  // from the reference on
  const auto prepare = [&](int index) -> Prepared {
    const Frame frame = frames.pose_frame(index);
    return {prepare_alignment(frame, field), corners(frame, spacing_px)};
  };
  const auto load = [&](int index) -> const Prepared& {
    const auto [place, fresh] = prepared.try_emplace(index);
    if (fresh) place->second = prepare(index);
    return place->second;
  };
  TrackChain chain;
  LookBack memory(frames.valid());
  // Where the chain broke before this key frame: the points of an earlier one go on.
  int bridges = 0;
  const auto look_back = [&](const AlignImage& image) {
    memory.add(image.index, image.gray);
    for (const LookBack::Candidate& earlier : memory.candidates(image.index, kLookedBackAt)) {
      const AlignGuess known{chain.starts(earlier.frame, {}, spacing_px), earlier.flow, false, {}};
      const auto pair = align(prepare_alignment(frames.pose_frame(earlier.frame), field), image,
                              align_options, pair_seed(seed, earlier.frame, image.index), known);
      if (!pair) continue;
      chain.add(image.index, pair->point_index, pair->moving_px, spacing_px);
      memory.link(earlier.frame, image.index);
      ++bridges;
      return;
    }
  };
  std::optional<PairAlignment> previous;  // k - 1 to k
  // The flow between the next two key frames, measured while this one's neighbours are aligned.
  struct {
    int reference = -1, moving = -1;
    PairFlow flow;
  } ahead;
  int failed = 0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    const AlignImage& reference = load(at[k]).image;
    look_back(reference);
    const cv::Size size = reference.gray.size();
    const std::vector<Vec2> points = chain.starts(at[k], load(at[k]).corners, spacing_px);
    const auto follow = [&](const AlignImage& moving, const cv::Mat& guess, bool affine) {
      AlignGuess known{points, guess, affine, {}};
      if (guess.empty() && ahead.reference == reference.index && ahead.moving == moving.index)
        known.measured = ahead.flow;
      return align(reference, moving, align_options, pair_seed(seed, reference.index, moving.index),
                   known);
    };
    // To the next key frame: whatever the motion, or else as it was before.
    const auto follow_next = [&](const AlignImage& next) {
      auto found = follow(next, {}, true);
      if (!found && previous) found = follow(next, continued(*previous, next.index, size), true);
      return found;
    };
    std::vector<std::optional<PairAlignment>> found;
    if (k + 1 < at.size()) {
      found.push_back(follow_next(load(at[k + 1]).image));
      // Algorithm 2 goes by a mean flow that fast motion escapes, and a near wall's beside a far
      // one's: the next key frame then comes too late, and the points are lost on the way to it.
      // The one half way becomes a key frame too.
      const auto kept = [](const std::optional<PairAlignment>& pair) {
        return pair ? pair->point_index.size() : 0;
      };
      const double enough = kMinFollowedShare * static_cast<double>(points.size());
      for (int next = at[k + 1];
           static_cast<double>(kept(found[0])) < enough && next - at[k] > 1;) {
        next = at[k] + (next - at[k]) / 2;
        auto nearer = follow_next(load(next).image);
        if (kept(nearer) <= kept(found[0])) continue;
        found[0] = std::move(nearer);
        at.insert(at.begin() + static_cast<std::ptrdiff_t>(k) + 1, next);
      }
      // Few even so: what was found shows the way to the rest, or the motion before does.
      const AlignImage& next = load(at[k + 1]).image;
      for (int round = 0; round < kMoreRounds && static_cast<double>(kept(found[0])) < enough;
           ++round) {
        std::vector<cv::Mat> guesses;
        if (found[0]) guesses.push_back(continued_from(*found[0], next.index, size));
        if (previous) guesses.push_back(continued(*previous, next.index, size));
        for (const cv::Mat& guess : guesses)
          if (auto more = follow(next, guess, true); kept(more) > kept(found[0]))
            found[0] = std::move(more);
      }
    }
    // To those after it: the motion to the next goes on.
    const std::size_t count =
        std::min(at.size() - 1 - k, static_cast<std::size_t>(align_options.neighbours));
    found.resize(count);
    for (std::size_t i = 1; i < count; ++i) load(at[k + 1 + i]);
    tbb::task_group tasks;
    for (std::size_t i = 1; i < count; ++i) {
      tasks.run([&, i] {
        const AlignImage& moving = prepared.at(at[k + 1 + i]).image;
        if (found[0])
          found[i] = follow(moving, continued_from(*found[0], moving.index, size), false);
        if (!found[i]) found[i] = follow(moving, {}, false);
      });
    }
    // Meanwhile, what the next key frame will ask for first.
    PairFlow next_flow;
    if (k + 2 < at.size() && count > 1) {
      tasks.run([&] {
        next_flow = measure_flow(prepared.at(at[k + 1]).image, prepared.at(at[k + 2]).image);
      });
    }
    const std::size_t newcomer = k + 1 + static_cast<std::size_t>(align_options.neighbours);
    Prepared arriving;
    const bool arrives = newcomer < at.size() && !prepared.contains(at[newcomer]);
    if (arrives) tasks.run([&] { arriving = prepare(at[newcomer]); });
    tasks.wait();
    if (arrives) prepared[at[newcomer]] = std::move(arriving);
    if (k + 2 < at.size() && count > 1) ahead = {at[k + 1], at[k + 2], std::move(next_flow)};
    if (previous && !found.empty() && !found[0]) memory.end(*previous);
    previous.reset();
    for (std::size_t i = 0; i < count; ++i) {
      if (!found[i]) {
        ++failed;
        continue;
      }
      chain.add(found[i]->moving, found[i]->point_index, found[i]->moving_px, spacing_px);
      memory.link(found[i]->reference, found[i]->moving);
      if (i == 0) previous = found[0];
      followed.pairs.push_back(std::move(*found[i]));
    }
    if (std::ranges::binary_search(keyframes.frames, at[k])) progress.step();
    if (k + 1 < at.size()) prepared.erase(prepared.begin(), prepared.lower_bound(at[k + 1]));
  }
  followed.tracks = chain.finish();
  number_keyframes(followed.tracks, at);
  set_rays(followed.tracks, frames.lens());
  progress.end(fmt::format("{} pairs, {} failed, {} tracks, {} key frames more{}",
                           followed.pairs.size(), failed, followed.tracks.size(),
                           at.size() - keyframes.frames.size(),
                           bridges > 0 ? fmt::format(", {} gaps bridged", bridges) : ""));
  return followed;
}

}  // namespace rugae
