#include "recon/keyframes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <future>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "core/check.h"

namespace rugae {
namespace {

constexpr double kReferenceWidthPx = 640.0;  // of the threshold
constexpr int kWorkWidthPx = 320;            // the mean magnitude needs no finer flow than this
constexpr int kReadAhead = 8;                // frames prepared while others are compared
constexpr int kCoarsestPx = 24;              // shorter side of the top of the flow's pyramid
constexpr int kMaxLevels = 6;

int levels_for(const cv::Size& size) {
  int levels = 1;
  for (int side = std::min(size.width, size.height) / 2; side >= kCoarsestPx; side /= 2) ++levels;
  return std::min(levels, kMaxLevels);
}

double mean_magnitude(const cv::Mat& flow) {
  double sum = 0.0;
  for (int y = 0; y < flow.rows; ++y) {
    const auto* row = flow.ptr<cv::Vec2f>(y);
    double row_sum = 0.0;
    for (int x = 0; x < flow.cols; ++x) row_sum += std::hypot(row[x][0], row[x][1]);
    sum += row_sum;
  }
  return sum / static_cast<double>(flow.total());
}

struct Candidate {
  int index = -1;
  cv::Mat gray;  // shrunk
};

// Frames begin .. begin + kReadAhead - 1, shrunk, prepared in parallel.
std::vector<Candidate> prepare(const FrameSource& frames, int begin, int shrink) {
  const int count = std::max(0, std::min(kReadAhead, frames.size() - begin));
  std::vector<Candidate> block(static_cast<std::size_t>(count));
  tbb::parallel_for(0, count, [&](int i) {
    cv::Mat gray = frames.gray(begin + i);
    if (shrink > 1)
      cv::resize(gray, gray, {gray.cols / shrink, gray.rows / shrink}, 0, 0, cv::INTER_AREA);
    block[static_cast<std::size_t>(i)] = {begin + i, gray};
  });
  return block;
}

// The state of algorithm 2 between two frames.
class Selection {
 public:
  Selection(double threshold_px, int max_gap, double px_per_flow)
      : threshold_px_(threshold_px), max_gap_(max_gap), px_per_flow_(px_per_flow) {}

  void offer(const Candidate& frame) {
    std::deque<Candidate> queue{frame};
    while (!queue.empty()) {
      const Candidate candidate = queue.front();
      queue.pop_front();
      if (keys_.frames.empty()) {
        accept(candidate, 0.0);
        continue;
      }
      const double value = compare(candidate);
      if (value >= threshold_px_) {
        accept(candidate, value);
        continue;
      }
      failed_.push_back(candidate);
      values_.push_back(value);
      if (static_cast<int>(failed_.size()) < max_gap_) continue;
      // The frame with the largest value; those after it are compared again, with it.
      const auto best = std::max_element(values_.begin(), values_.end()) - values_.begin();
      const Candidate chosen = failed_[static_cast<std::size_t>(best)];
      queue.insert(queue.begin(), failed_.begin() + best + 1, failed_.end());
      accept(chosen, values_[static_cast<std::size_t>(best)]);
    }
  }

  Keyframes take() { return std::move(keys_); }

 private:
  double compare(const Candidate& candidate) {
    // The flow to the frame before is the first guess: displacements beyond the pyramid's reach
    // grow frame by frame.
    flow_ = farneback_flow(reference_.gray, candidate.gray, flow_);
    return px_per_flow_ * mean_magnitude(flow_);
  }

  void accept(const Candidate& frame, double value) {
    reference_ = frame;
    flow_.release();
    failed_.clear();
    values_.clear();
    keys_.frames.push_back(frame.index);
    keys_.mean_flow_px.push_back(value);
  }

  double threshold_px_;
  int max_gap_;
  double px_per_flow_;
  Candidate reference_;
  cv::Mat flow_;
  std::vector<Candidate> failed_;
  std::vector<double> values_;
  Keyframes keys_;
};

}  // namespace

cv::Mat farneback_flow(const cv::Mat& reference, const cv::Mat& moving, const cv::Mat& initial) {
  check(reference.type() == CV_8U && moving.type() == CV_8U && reference.size() == moving.size(),
        "optical flow: expected two 8-bit gray images of one size, found {} x {} and {} x {}",
        reference.cols, reference.rows, moving.cols, moving.rows);
  constexpr double kPyramidScale = 0.5;
  constexpr int kWindowPx = 21, kIterations = 3;
  constexpr int kPolynomialPx = 7;
  constexpr double kPolynomialSigmaPx = 1.5;
  cv::Mat flow;
  int flags = 0;
  if (!initial.empty()) {
    flow = initial.clone();
    flags |= cv::OPTFLOW_USE_INITIAL_FLOW;
  }
  cv::calcOpticalFlowFarneback(reference, moving, flow, kPyramidScale, levels_for(moving.size()),
                               kWindowPx, kIterations, kPolynomialPx, kPolynomialSigmaPx, flags);
  return flow;
}

Keyframes select_keyframes(const FrameSource& frames, const KeyframeOptions& options,
                           Progress& progress) {
  options.check();
  const int width = frames.lens().width;
  const int shrink = std::max(1, width / kWorkWidthPx);
  Selection selection(options.mean_flow_px * width / kReferenceWidthPx, options.max_gap, shrink);
  progress.begin("key frames", static_cast<std::size_t>(frames.size()));
  std::vector<Candidate> block = prepare(frames, 0, shrink);
  while (!block.empty()) {
    const int next = block.back().index + 1;
    std::future<std::vector<Candidate>> ahead =
        std::async(std::launch::async, [&] { return prepare(frames, next, shrink); });
    for (const Candidate& frame : block) {
      selection.offer(frame);
      progress.step();
    }
    block = ahead.get();
  }
  Keyframes keys = selection.take();
  progress.end(fmt::format("{} of {} frames", keys.frames.size(), frames.size()));
  return keys;
}

}  // namespace rugae
