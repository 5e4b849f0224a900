#include "recon/look_back.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "recon/flow.h"
#include "recon/flow_guess.h"

namespace rugae {
namespace {

constexpr double kWidthPx = 64.0;     // of the small pictures
constexpr double kMiddleShare = 0.6;  // of a picture, each way, is looked for in the other
constexpr double kMinLikeness = 0.4;  // less is found between any two places
/// A motion is not thought to go on for longer than this many times as long as it was seen.
constexpr int kMaxContinued = 8;

}  // namespace

LookBack::LookBack(const cv::Mat& valid)
    : shrink_(std::max(1.0, valid.cols / kWidthPx)), size_(valid.size()) {
  cv::resize(valid, valid_, {}, 1.0 / shrink_, 1.0 / shrink_, cv::INTER_AREA);
}

void LookBack::add(int frame, const cv::Mat& gray) {
  cv::Mat small;
  cv::resize(gray, small, valid_.size(), 0.0, 0.0, cv::INTER_AREA);
  seen_[frame] = even_light(small, valid_ == 255);
  parent_.try_emplace(frame, frame);
  ++sizes_[root_of(frame)];
}

int LookBack::root_of(int frame) const {
  while (parent_.at(frame) != frame) frame = parent_.at(frame);
  return frame;
}

void LookBack::link(int frame, int other) {
  parent_.try_emplace(frame, frame);
  parent_.try_emplace(other, other);
  const auto [first, second] = std::minmax({root_of(frame), root_of(other)});
  if (first == second) return;
  parent_[second] = first;
  sizes_[first] += sizes_[second];
  sizes_.erase(second);
}

void LookBack::end(const PairAlignment& last) { ends_.push_back(last); }

// Of as many, those that began first.
bool LookBack::with_most(int frame) const {
  const int own = root_of(frame), size = sizes_.at(own);
  return std::ranges::all_of(sizes_, [&](const auto& of_root) {
    return of_root.second < size || (of_root.second == size && of_root.first >= own);
  });
}

std::vector<LookBack::Candidate> LookBack::alike(int frame, std::size_t count) const {
  struct Alike {
    double likeness = 0.0;  // normalised correlation
    int frame = -1;
    cv::Scalar shift_px;
  };
  const int own = root_of(frame);
  const cv::Mat& picture = seen_.at(frame);
  const cv::Size size(static_cast<int>(std::lround(kMiddleShare * picture.cols)),
                      static_cast<int>(std::lround(kMiddleShare * picture.rows)));
  const cv::Point corner((picture.cols - size.width) / 2, (picture.rows - size.height) / 2);
  const cv::Mat middle = picture(cv::Rect(corner, size));
  std::vector<Alike> found;
  for (const auto& [key, other] : seen_) {
    if (root_of(key) == own) continue;
    cv::Mat scores;
    cv::matchTemplate(other, middle, scores, cv::TM_CCOEFF_NORMED);
    double likeness = 0.0;
    cv::Point best;
    cv::minMaxLoc(scores, nullptr, &likeness, nullptr, &best);
    if (!(likeness >= kMinLikeness)) continue;
    found.push_back(
        {likeness, key, {shrink_ * (corner.x - best.x), shrink_ * (corner.y - best.y)}});
  }
  std::ranges::stable_sort(found, std::greater{}, &Alike::likeness);
  if (found.size() > count) found.resize(count);
  std::vector<Candidate> candidates;
  for (const Alike& one : found)
    candidates.push_back({one.frame, cv::Mat(size_, CV_32FC2, one.shift_px)});
  return candidates;
}

std::vector<LookBack::Candidate> LookBack::candidates(int frame, std::size_t count) const {
  check(seen_.contains(frame), "LookBack: frame {} was not added", frame);
  if (with_most(frame)) return {};
  std::vector<Candidate> found;
  const auto last = std::ranges::find_if(
      ends_.rbegin(), ends_.rend(),
      [&](const PairAlignment& pair) { return root_of(pair.moving) != root_of(frame); });
  if (last != ends_.rend() &&
      frame - last->moving <= kMaxContinued * (last->moving - last->reference))
    found.push_back({last->moving, continued(*last, frame, size_)});
  for (Candidate& candidate : alike(frame, count - std::min(count, found.size())))
    found.push_back(std::move(candidate));
  return found;
}

}  // namespace rugae
