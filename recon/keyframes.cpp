#include "recon/keyframes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/flow.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;  // of the threshold
constexpr int kWorkWidthPx = 160;            // the mean magnitude needs no finer flow than this
constexpr int kPreparedAtOnce = 8;           // frames

// Over the valid pixels.
double mean_magnitude(const cv::Mat& flow, const cv::Mat& valid) {
  double sum = 0.0;
  for (int y = 0; y < flow.rows; ++y) {
    const auto* row = flow.ptr<cv::Vec2f>(y);
    double row_sum = 0.0;
    const auto* known = valid.ptr<unsigned char>(y);
    for (int x = 0; x < flow.cols; ++x)
      if (known[x]) row_sum += std::hypot(row[x][0], row[x][1]);
    sum += row_sum;
  }
  return sum / std::max(1, cv::countNonZero(valid));
}

struct Candidate {
  int index = -1;
  FlowImage image;  // shrunk
};

// Frames begin .. begin + kPreparedAtOnce - 1, those before `end`, shrunk, prepared in parallel;
// `valid` is as small.
std::vector<Candidate> prepare(const FrameSource& frames, int begin, int end, int shrink,
                               const cv::Mat& valid) {
  const int count = std::max(0, std::min(kPreparedAtOnce, end - begin));
  std::vector<Candidate> block(static_cast<std::size_t>(count));
  tbb::parallel_for(0, count, [&](int i) {
    cv::Mat gray = frames.gray(begin + i);
    if (shrink > 1)
      cv::resize(gray, gray, {gray.cols / shrink, gray.rows / shrink}, 0, 0, cv::INTER_AREA);
    block[static_cast<std::size_t>(i)] = {begin + i, prepare_flow(gray, valid)};
  });
  return block;
}

// 255 where all of the shrunk pixel is valid.
cv::Mat shrunk_valid(cv::Mat valid, int shrink) {
  if (shrink > 1)
    cv::resize(valid, valid, {valid.cols / shrink, valid.rows / shrink}, 0, 0, cv::INTER_AREA);
  return valid == 255;
}

// The state of algorithm 2 between two frames.
class Selection {
 public:
  /// `valid` is as small as the candidates.
  Selection(double threshold_px, int max_gap, double px_per_flow, cv::Mat valid)
      : threshold_px_(threshold_px),
        max_gap_(max_gap),
        px_per_flow_(px_per_flow),
        valid_(std::move(valid)) {}

  /// One after the other: two compared at once would often be one too many, for once a candidate
  /// becomes the reference the values of those after it are void.
  void offer(const Candidate& frame) {
    queue_.push_back(frame);
    while (!queue_.empty()) {
      if (keys_.frames.empty()) {
        accept(next(), 0.0);
        continue;
      }
      const double flow =
          mean_magnitude(farneback_flow(reference_.image, queue_.front().image), valid_);
      decide(next(), px_per_flow_ * flow);
    }
  }

  const Keyframes& keyframes() const { return keys_; }

 private:
  Candidate next() {
    Candidate front = queue_.front();
    queue_.pop_front();
    return front;
  }

  void decide(const Candidate& candidate, double value) {
    if (value >= threshold_px_) return accept(candidate, value);
    failed_.push_back(candidate);
    values_.push_back(value);
    if (static_cast<int>(failed_.size()) < max_gap_) return;
    // The frame with the largest value; those after it are compared again, with it.
    const auto best = std::max_element(values_.begin(), values_.end()) - values_.begin();
    const Candidate chosen = failed_[static_cast<std::size_t>(best)];
    queue_.insert(queue_.begin(), failed_.begin() + best + 1, failed_.end());
    accept(chosen, values_[static_cast<std::size_t>(best)]);
  }

  void accept(const Candidate& frame, double value) {
    reference_ = frame;
    failed_.clear();
    values_.clear();
    keys_.frames.push_back(frame.index);
    keys_.mean_flow_px.push_back(value);
  }

  double threshold_px_;
  int max_gap_;
  double px_per_flow_;
  cv::Mat valid_;
  Candidate reference_;
  std::deque<Candidate> queue_;
  std::vector<Candidate> failed_;
  std::vector<double> values_;
  Keyframes keys_;
};

}  // namespace

struct KeyframeSelector::Impl {
  const FrameSource& frames;
  int shrink;
  cv::Mat valid;  // shrunk
  Selection selection;
  int next = 0;

  Impl(const FrameSource& source, const KeyframeOptions& options)
      : frames(source),
        shrink(std::max(1, source.lens().width / kWorkWidthPx)),
        valid(shrunk_valid(source.valid(), shrink)),
        selection(options.mean_flow_px * source.lens().width / kReferenceWidthPx, options.max_gap,
                  shrink, valid) {}
};

KeyframeSelector::KeyframeSelector(const FrameSource& frames, const KeyframeOptions& options) {
  options.check();
  impl_ = std::make_unique<Impl>(frames, options);
}
KeyframeSelector::~KeyframeSelector() = default;

void KeyframeSelector::advance(int end) {
  Impl& s = *impl_;
  while (s.next < end) {
    for (const Candidate& frame : prepare(s.frames, s.next, end, s.shrink, s.valid)) {
      s.next = frame.index + 1;
      s.selection.offer(frame);
    }
  }
}

const Keyframes& KeyframeSelector::keyframes() const { return impl_->selection.keyframes(); }

}  // namespace rugae
