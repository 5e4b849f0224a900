#include "recon/reconstruction.h"

#include "core/check.h"
#include "core/files.h"
#include "recon/pictures.h"
#include "recon/pipeline.h"

namespace rugae {
namespace {

constexpr int kBlock = 8;  // frames that are looked at together where nobody asks for the latest

// Adds to a stage how long it lives.
class Timer {
 public:
  explicit Timer(StageTime& stage) : stage_(stage) {}
  ~Timer() {
    stage_.seconds += std::chrono::duration<double>(Clock::now() - start_).count();
    stage_.peak_rss_mb = peak_rss_mb();
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  StageTime& stage_;
  Clock::time_point start_ = Clock::now();
};

// A listener hears of progress as long as this lives.
class Watched {
 public:
  Watched(Progress& progress, Listener* listener) : progress_(progress) {
    if (listener == nullptr) return;
    progress.watch([listener](const std::string& stage, std::size_t done, std::size_t total) {
      listener->progress(stage, done, total);
    });
  }
  ~Watched() { progress_.watch({}); }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

 private:
  Progress& progress_;
};

}  // namespace

Reconstruction::Reconstruction(const Observations& recorded, const ReconOptions& options)
    : options_(options), recorded_(true) {
  options.check();
  {
    const Timer timer(preprocessing_);
    frames_ = std::make_unique<FrameSource>(recorded, options.preprocess);
  }
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
  selector_ = std::make_unique<KeyframeSelector>(*frames_, options_.keyframes);
  follower_ = std::make_unique<TrackFollower>(*frames_, follow_options(options_), options_.tracks,
                                              options_.seed, recorded_);
}

void Reconstruction::check_open() const {
  check(selector_ != nullptr, "the reconstruction was finished");
}

void Reconstruction::add() {
  check_open();
  check(recorded_ && added_ < frames_->size(), "frame {} of {}: no such frame", added_,
        frames_->size());
  ++added_;
  if (added_ - looked_at_ >= kBlock) follow_what_came();
}

void Reconstruction::add(const cv::Mat& bgr, double time_s) {
  check_open();
  check(!recorded_, "a frame was added to a recorded sequence");
  frames_->append(bgr, time_s);
  ++added_;
  follow_what_came();
}

void Reconstruction::follow_what_came() {
  {
    const Timer timer(selecting_);
    selector_->advance(added_);
    looked_at_ = added_;
  }
  {
    const Timer timer(following_);
    const std::vector<int>& chosen = selector_->keyframes().frames;
    for (; followed_ < chosen.size(); ++followed_) follower_->add(chosen[followed_]);
  }
  show_what_was_followed();
}

// The last key frame is not shown yet: nothing was followed from it, and more may lead into it.
void Reconstruction::show_what_was_followed() {
  if (listener_ == nullptr) return;
  const std::vector<int> settled = follower_->settled();
  for (; shown_ + 1 < settled.size(); ++shown_) {
    const int frame = settled[shown_];
    std::vector<FollowedPoint> points;
    for (const int t : follower_->chain().through(frame)) {
      const Track& track = follower_->chain().tracks()[static_cast<std::size_t>(t)];
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
  if (looked_at_ < added_) follow_what_came();
  if (!live_) live_ = std::make_unique<LivePath>(*frames_, options_);
  live_->update(*follower_);
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
  return make_map(*frames_, structure, follower_->pairs(), options_, Stages(), quiet).mesh;
}

Estimate Reconstruction::finish(const std::filesystem::path& out, Progress& progress) {
  check_open();
  progress.end();  // the caller's loop over frames: its parts have times of their own
  if (looked_at_ < added_) follow_what_came();
  Followed followed = [&] {
    const Timer timer(following_);
    return follower_->finish();
  }();
  live_.reset();
  selector_.reset();
  follower_.reset();
  const Watched watched(progress, listener_);
  const Stages stages;
  const auto earlier = static_cast<std::ptrdiff_t>(progress.stages().size());
  if (!recorded_) {
    progress.begin("preprocessing");
    frames_ = std::make_unique<FrameSource>(frames_->observations(), options_.preprocess);
  }
  Motion motion = solve_motion(*frames_, std::move(followed), options_, stages, progress);
  motion.stages = {preprocessing_, selecting_, following_};
  motion.stages.insert(motion.stages.end(), progress.stages().begin() + earlier,
                       progress.stages().end());
  return build_map(*frames_, motion, options_, out, stages, progress, listener_);
}

}  // namespace rugae
