#include "recon/preprocess/preprocess.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "recon/cache.h"
#include "recon/preprocess/devignette.h"
#include "recon/preprocess/packed_mask.h"
#include "recon/preprocess/reflections.h"
#include "recon/preprocess/undistort.h"

namespace rugae {
namespace {

constexpr int kVignettingFrames = 16;  // spread over the sequence
constexpr int kProfileSamples = 257;   // of the published profile
constexpr std::size_t kCachedFrames = 6;
constexpr std::size_t kCachedMapFrames = 32;  // the members of two neighbouring mosaics
constexpr std::size_t kCachedRaws = 24;  // as many as are looked ahead for key frames, and more

// Gray frames, and as many reflections: both are wanted again by each stage of the path.
std::size_t held_of(const Lens& lens) {
  const auto bytes = static_cast<std::size_t>(lens.width) * lens.height;
  return std::max(kCachedRaws, FrameSource::kMostHeldBytes / (bytes + bytes / 8));
}

}  // namespace

struct FrameSource::Impl {
  Observations observations;
  PreprocessOptions options;
  Lens lens;
  std::optional<Undistortion> undistortion;
  std::optional<RollingShutter> shutter;
  cv::Mat field;  // of the observations: 255 inside the field stop
  cv::Mat valid;
  cv::Mat gain;  // 1 / V; empty when switched off
  std::vector<double> profile;
  Cache<Frame> frames{kCachedFrames}, map_frames{kCachedMapFrames};
  Cache<cv::Mat> raws{kCachedRaws}, detections{kCachedRaws};  // as observed
  Cache<cv::Mat> grays, reflections;                          // the reflections packed

  Impl(const Observations& source, const PreprocessOptions& chosen)
      : observations(source),
        options(chosen),
        lens(source.lens()),
        grays(held_of(lens)),
        reflections(held_of(lens)) {
    options.check();
    const Lens& original = observations.lens();
    field = cv::Mat(original.height, original.width, CV_8U, cv::Scalar(0));
    for (int y = 0; y < original.height; ++y)
      for (int x = 0; x < original.width; ++x)
        if (original.passes_stop({x + 0.5, y + 0.5})) field.at<unsigned char>(y, x) = 255;
    if (options.undistort) {
      lens = observations.lens().pinhole();
      undistortion.emplace(observations.lens(), lens);
      valid = undistortion->valid();
    } else {
      valid = field;
    }
    shutter.emplace(lens, original, observations.row_time_s());
    if (options.devignette && observations.size() > 0) estimate_gain();
  }

  cv::Mat move(const cv::Mat& image) const {
    return undistortion ? undistortion->image(image) : image;
  }
  cv::Mat move_mask(const cv::Mat& mask) const {
    return undistortion ? undistortion->mask(mask) : mask;
  }
  cv::Mat correct(const cv::Mat& image) const {
    return gain.empty() ? image : apply_gain(image, gain);
  }
  static cv::Mat gray_of(const cv::Mat& bgr) {
    cv::Mat gray;
    cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
    return gray;
  }
  cv::Mat detected_in(const cv::Mat& raw_gray) const {
    return detect_reflections(raw_gray, options.reflections, field);
  }
  cv::Mat raw(int index) {
    return raws.get(index, [&] { return gray_of(observations.image(index)); });
  }
  cv::Mat detected(int index) {
    return detections.get(index, [&] { return detected_in(raw(index)); });
  }
  cv::Mat reflection(int index) {
    return unpacked_mask(
        reflections.get(index, [&] { return packed_mask(move_mask(detected(index))); }),
        lens.width);
  }

  void estimate_gain() {
    const std::vector<int> indices = vignetting_frames(observations.size());
    std::vector<cv::Mat> images(indices.size()), usable(indices.size());
    tbb::parallel_for(std::size_t{0}, indices.size(), [&](std::size_t i) {
      images[i] = move(raw(indices[i]));
      usable[i] = valid & ~reflection(indices[i]);
    });
    const double reach_px = 0.5 * std::hypot(lens.width, lens.height);
    const VignettingProfile found =
        estimate_vignetting(images, usable, {lens.cx, lens.cy}, reach_px);
    gain = vignetting_gain(found, lens.width, lens.height);
    for (int k = 0; k < kProfileSamples; ++k)
      profile.push_back(found.at(reach_px * k / (kProfileSamples - 1.0)));
  }

  cv::Mat gray(int index) {
    return grays.get(index, [&] {
      cv::Mat gray = raw(index);
      if (options.reflections.suppress_for_pose)
        gray = suppress_reflections(gray, detected(index), options.reflections);
      return correct(move(gray));
    });
  }

  cv::Mat map_bgr(int index) {
    cv::Mat bgr = observations.image(index);
    if (options.reflections.suppress_for_map)
      bgr = suppress_reflections(bgr, detected_in(gray_of(bgr)), options.reflections);
    return correct(move(bgr));
  }
};

std::vector<int> vignetting_frames(int size) {
  const int count = std::min(kVignettingFrames, size);
  std::vector<int> frames;
  // The middle of the i-th of `count` equal parts of the sequence.
  for (int i = 0; i < count; ++i)
    frames.push_back(static_cast<int>((2LL * i + 1) * size / (2LL * count)));
  return frames;
}

FrameSource::FrameSource(const Observations& observations, const PreprocessOptions& options)
    : impl_(std::make_unique<Impl>(observations, options)) {}
FrameSource::~FrameSource() = default;

void FrameSource::append(const cv::Mat& bgr, double time_s) {
  impl_->observations.append(bgr, time_s);
}
int FrameSource::size() const { return impl_->observations.size(); }
const Lens& FrameSource::lens() const { return impl_->lens; }
const Observations& FrameSource::observations() const { return impl_->observations; }
const RollingShutter& FrameSource::shutter() const { return *impl_->shutter; }
const cv::Mat& FrameSource::field() const { return impl_->field; }
const cv::Mat& FrameSource::valid() const { return impl_->valid; }
const std::vector<double>& FrameSource::vignetting_profile() const { return impl_->profile; }

Frame FrameSource::frame(int index) const {
  check_index(index);
  return impl_->frames.get(index, [&] {
    return Frame{index, impl_->gray(index), impl_->map_bgr(index), impl_->reflection(index),
                 impl_->valid};
  });
}

Frame FrameSource::pose_frame(int index) const {
  check_index(index);
  return {index, impl_->gray(index), {}, impl_->reflection(index), impl_->valid};
}

Frame FrameSource::map_frame(int index) const {
  check_index(index);
  return impl_->map_frames.get(index, [&] {
    return Frame{index, {}, impl_->map_bgr(index), {}, impl_->valid};
  });
}

cv::Mat FrameSource::gray(int index) const {
  check_index(index);
  return impl_->gray(index);
}

void FrameSource::release() const {
  impl_->raws.clear();
  impl_->detections.clear();
  impl_->grays.clear();
  impl_->reflections.clear();
}

void FrameSource::check_index(int index) const {
  check(index >= 0 && index < size(), "frame {} of {}: no such frame", index, size());
}

}  // namespace rugae
