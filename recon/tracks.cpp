#include "recon/tracks.h"

#include <fmt/format.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "core/random.h"
#include "recon/flow_guess.h"
#include "recon/look_back.h"

namespace rugae {
namespace {

constexpr std::size_t kPairsWithCorrespondences = 12;  // at least, where there are so many
constexpr double kReferenceWidth = 640.0;              // pixel options are meant at this width
constexpr double kCornerQuality = 0.002;  // of the best corner: weak texture counts, noise does not
constexpr int kCornerBlock = 7;           // px
// Of the points of a key frame, those found in the next: three quarters as a rule, less than this
// where the next comes too late.
constexpr double kMinFollowedShare = 0.5;
constexpr int kBorder = 8;                // px: no corner nearer to where the image ends
constexpr int kMoreRounds = 2;            // of following again, where few points were found
constexpr std::size_t kLookedBackAt = 3;  // earlier key frames, where the chain broke

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

std::optional<Vec2> ray_of(const LensProjector& lens, const Vec2& pixel) {
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
  const LensProjector projector(lens);
  for (Track& track : tracks) {
    std::erase_if(track.observations, [&](Track::Observation& o) {
      const auto ray = ray_of(projector, o.pixel);
      if (ray) o.ray = *ray;
      return !ray;
    });
  }
}

struct TrackFollower::Impl {
  const FrameSource& frames;
  AlignOptions align_options;
  std::uint64_t seed;
  double spacing_px;
  std::size_t needed;  // key frames behind k, before it is followed from
  AlignField field;
  std::vector<int> at;               // key frames, as selected and between; the first `k` are done
  std::size_t k = 0;                 // the next to follow from
  std::map<int, Prepared> prepared;  // from the reference on
  TrackChain chain;
  LookBack memory;
  std::optional<PairAlignment> previous;  // k - 1 to k
  // The flow between the next two key frames, measured while this one's neighbours are aligned.
  struct {
    int reference = -1, moving = -1;
    PairFlow flow;
  } ahead;
  std::vector<PairAlignment> pairs;
  std::size_t stride = 1;  // of those that keep their correspondences
  int failed = 0, bridges = 0, between = 0;

  Impl(const FrameSource& source, const AlignOptions& align, const TrackOptions& options,
       std::uint64_t of_run, bool look_ahead)
      : frames(source),
        align_options(align),
        seed(of_run),
        spacing_px(options.spacing_px * source.lens().width / kReferenceWidth),
        needed(static_cast<std::size_t>(align.neighbours) + (look_ahead ? 1 : 0)),
        field(prepare_field(source.valid(), align)),
        memory(source.valid()) {}

  void keep(PairAlignment pair) {
    if (pairs.size() % stride != 0) pair.forget_correspondences();
    pairs.push_back(std::move(pair));
    if (pairs.size() < 2 * kPairsWithCorrespondences * stride) return;
    stride *= 2;
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (i % stride != 0) pairs[i].forget_correspondences();
  }

  Prepared prepare(int index) const {
    const Frame frame = frames.pose_frame(index);
    return {prepare_alignment(frame, field), corners(frame, spacing_px)};
  }
  const Prepared& load(int index) {
    const auto [place, fresh] = prepared.try_emplace(index);
    if (fresh) place->second = prepare(index);
    return place->second;
  }

  // Where the chain broke before this key frame: the points of an earlier one go on.
  void look_back(const AlignImage& image) {
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
  }

  std::optional<PairAlignment> follow(const AlignImage& reference, const AlignImage& moving,
                                      const std::vector<Vec2>& points, const cv::Mat& guess,
                                      bool affine) const {
    AlignGuess known{points, guess, affine, {}};
    if (guess.empty() && ahead.reference == reference.index && ahead.moving == moving.index)
      known.measured = ahead.flow;
    return align(reference, moving, align_options, pair_seed(seed, reference.index, moving.index),
                 known);
  }
  // To the next key frame: whatever the motion, or else as it was before.
  std::optional<PairAlignment> follow_next(const AlignImage& reference, const AlignImage& next,
                                           const std::vector<Vec2>& points) const {
    auto found = follow(reference, next, points, {}, true);
    if (!found && previous)
      found = follow(reference, next, points,
                     continued(*previous, next.index, reference.gray.size()), true);
    return found;
  }

  // From key frame k to the next, and where that one comes too late to one between.
  std::optional<PairAlignment> to_the_next(const std::vector<Vec2>& points) {
    const AlignImage& reference = load(at[k]).image;
    const cv::Size size = reference.gray.size();
    auto found = follow_next(reference, load(at[k + 1]).image, points);
    // Algorithm 2 goes by a mean flow that fast motion escapes, and a near wall's beside a far
    // one's: the next key frame then comes too late, and the points are lost on the way to it.
    // The one half way becomes a key frame too.
    const auto kept = [](const std::optional<PairAlignment>& pair) {
      return pair ? pair->point_index.size() : 0;
    };
    const double enough = kMinFollowedShare * static_cast<double>(points.size());
    for (int next = at[k + 1]; static_cast<double>(kept(found)) < enough && next - at[k] > 1;) {
      next = at[k] + (next - at[k]) / 2;
      auto nearer = follow_next(reference, load(next).image, points);
      if (kept(nearer) <= kept(found)) continue;
      found = std::move(nearer);
      at.insert(at.begin() + static_cast<std::ptrdiff_t>(k) + 1, next);
      ++between;
    }
    // Few even so: what was found shows the way to the rest, or the motion before does.
    const AlignImage& next = load(at[k + 1]).image;
    for (int round = 0; round < kMoreRounds && static_cast<double>(kept(found)) < enough; ++round) {
      std::vector<cv::Mat> guesses;
      if (found) guesses.push_back(continued_from(*found, next.index, size));
      if (previous) guesses.push_back(continued(*previous, next.index, size));
      for (const cv::Mat& guess : guesses)
        if (auto more = follow(reference, next, points, guess, true); kept(more) > kept(found))
          found = std::move(more);
    }
    return found;
  }

  // Follows from key frame k.
  void step() {
    look_back(load(at[k]).image);
    const std::vector<Vec2> points = chain.starts(at[k], load(at[k]).corners, spacing_px);
    std::vector<std::optional<PairAlignment>> found;
    if (k + 1 < at.size()) found.push_back(to_the_next(points));
    const AlignImage& reference = load(at[k]).image;
    const cv::Size size = reference.gray.size();
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
          found[i] = follow(reference, moving, points,
                            continued_from(*found[0], moving.index, size), false);
        if (!found[i]) found[i] = follow(reference, moving, points, {}, false);
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
      keep(std::move(*found[i]));
    }
    if (k + 1 < at.size()) prepared.erase(prepared.begin(), prepared.lower_bound(at[k + 1]));
    ++k;
  }
};

TrackFollower::TrackFollower(const FrameSource& frames, const AlignOptions& align_options,
                             const TrackOptions& options, std::uint64_t seed, bool ahead)
    : impl_(std::make_unique<Impl>(frames, align_options, options, seed, ahead)) {}
TrackFollower::~TrackFollower() = default;

void TrackFollower::add(int frame) {
  Impl& s = *impl_;
  check(s.at.empty() || frame > s.at.back(), "key frame {} after {}, expected a later one", frame,
        s.at.empty() ? -1 : s.at.back());
  s.at.push_back(frame);
  while (s.k + s.needed < s.at.size()) s.step();
}

Followed TrackFollower::finish() {
  Impl& s = *impl_;
  while (s.k < s.at.size()) s.step();
  Followed followed{s.at, std::move(s.pairs), s.chain.finish(), {}};
  number_keyframes(followed.tracks, followed.keyframes);
  set_rays(followed.tracks, s.frames.lens());
  return followed;
}

std::vector<int> TrackFollower::settled() const {
  const Impl& s = *impl_;
  const auto count = static_cast<std::ptrdiff_t>(std::min(s.k + 1, s.at.size()));
  return {s.at.begin(), s.at.begin() + count};
}

const TrackChain& TrackFollower::chain() const { return impl_->chain; }
const std::vector<PairAlignment>& TrackFollower::pairs() const { return impl_->pairs; }

std::string TrackFollower::remark() const {
  const Impl& s = *impl_;
  return fmt::format("{} failed, {} key frames more{}", s.failed, s.between,
                     s.bridges > 0 ? fmt::format(", {} gaps bridged", s.bridges) : "");
}

}  // namespace rugae
