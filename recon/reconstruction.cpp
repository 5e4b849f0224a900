#include "recon/reconstruction.h"

#include "core/check.h"
#include "core/files.h"
#include "core/seconds_of.h"
#include "recon/pictures.h"
#include "recon/pipeline.h"

namespace rugae {
namespace {

// A listener hears of progress as long as this lives.
class Watched {
 public:
  Watched(Progress& progress, Listener* listener)
      : progress_(progress), watches_(listener != nullptr) {
    if (!watches_) return;
    progress.watch([listener](const std::string& stage, std::size_t done, std::size_t total) {
      listener->progress(stage, done, total);
    });
  }
  ~Watched() {
    if (watches_) progress_.watch({});
  }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

 private:
  Progress& progress_;
  bool watches_;
};

}  // namespace

Reconstruction::Reconstruction(const Observations& recorded, const ReconOptions& options)
    : options_(options), recorded_(true) {
  options.check();
  preprocessing_.seconds =
      seconds_of([&] { frames_ = std::make_unique<FrameSource>(recorded, options.preprocess); });
  preprocessing_.peak_rss_mb = peak_rss_mb();
  begin();
}

Reconstruction::Reconstruction(const std::filesystem::path& folder, const Calibration& calibration,
                               const ReconOptions& options)
    : options_(options), recorded_(false) {
  options.check();
  PreprocessOptions preprocess = options.preprocess;
  preprocess.devignette = false;
  frames_ = std::make_unique<FrameSource>(Observations::record(folder, calibration), preprocess);
  begin();
}

Reconstruction::~Reconstruction() = default;

void Reconstruction::begin() {
  follower_ = std::make_unique<FrameFollower>(*frames_, options_, recorded_);
}

void Reconstruction::check_open() const {
  check(follower_ != nullptr, "the reconstruction was finished");
}

void Reconstruction::add() {
  check_open();
  check(recorded_ && added_ < frames_->size(), "frame {} of {}: no such frame", added_,
        frames_->size());
  ++added_;
  if (added_ - follower_->looked_at() < kFramesAtOnce) return;
  follower_->look_at(added_);
  show_what_was_followed();
}

void Reconstruction::add(const cv::Mat& bgr, double time_s) {
  check_open();
  check(!recorded_, "a frame was added to a recorded sequence");
  frames_->append(bgr, time_s);
  ++added_;
  catch_up();
}

void Reconstruction::catch_up() {
  if (follower_->looked_at() < added_) follower_->look_at(added_);
  follower_->catch_up();
  show_what_was_followed();
}

// The last key frame is not shown yet: nothing was followed from it, and more may lead into it.
void Reconstruction::show_what_was_followed() {
  const TrackChain& chain = follower_->tracks().chain();
  const std::vector<int> settled = follower_->tracks().settled();
  for (; shown_ + 1 < settled.size(); ++shown_) {
    if (listener_ == nullptr) continue;
    const int frame = settled[shown_];
    std::vector<FollowedPoint> points;
    for (const int t : chain.through(frame)) {
      const Track& track = chain.tracks()[static_cast<std::size_t>(t)];
      for (const auto& o : track.observations)
        if (o.keyframe == frame) points.push_back({o.pixel, track.observations.size()});
    }
    draw_followed(
        [&](const std::string& name, const cv::Mat& image) { listener_->picture(name, image); },
        frames_->gray(frame), frame, points);
  }
}

LivePath& Reconstruction::live() {
  check_open();
  catch_up();
  if (!live_) live_ = std::make_unique<LivePath>(*frames_, options_);
  live_->update(follower_->tracks());
  return *live_;
}

std::optional<Rigid3> Reconstruction::pose() {
  const LivePath& path = live();
  if (added_ == 0) return std::nullopt;
  const auto pose = path.place(added_ - 1);
  return pose ? std::optional(pose->inverse()) : std::nullopt;
}

const Structure& Reconstruction::structure() { return live().structure(); }

TriangleMesh Reconstruction::map() {
  Structure structure = live().structure();
  if (structure.placed_count() == 0) return {};
  remove_outliers(structure);
  Progress quiet(Progress::Output::silent);
  // These poses take every shutter for a global one.
  return make_map(*frames_, structure, {}, follower_->tracks().pairs(), options_, Stages(), quiet)
      .mesh;
}

Estimate Reconstruction::finish(const std::filesystem::path& out, Progress& progress) {
  check_open();
  check(!recorded_ || added_ == frames_->size(), "{}: {} of {} frames were added before the end",
        frames_->observations().name(), added_, frames_->size());
  progress.end();  // the caller's loop over frames: its parts have times of their own
  catch_up();
  Followed followed = follower_->finish();
  const std::vector<StageTime> following = followed.stages;
  live_.reset();
  follower_.reset();
  const Watched watched(progress, listener_);
  const Stages stages;
  const auto earlier = static_cast<std::ptrdiff_t>(progress.stages().size());
  if (!recorded_) {
    progress.begin("preprocessing");
    frames_ = std::make_unique<FrameSource>(frames_->observations(), options_.preprocess);
  }
  Motion motion = solve_motion(*frames_, std::move(followed), options_, stages, progress);
  if (recorded_) motion.stages = {preprocessing_};
  motion.stages.insert(motion.stages.end(), following.begin(), following.end());
  motion.stages.insert(motion.stages.end(), progress.stages().begin() + earlier,
                       progress.stages().end());
  return build_map(*frames_, motion, options_, out, stages, progress, listener_);
}

}  // namespace rugae
