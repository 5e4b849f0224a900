#include "recon/preprocess/preprocess.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "recon/cache.h"
#include "recon/preprocess/devignette.h"
#include "recon/preprocess/reflections.h"
#include "recon/preprocess/undistort.h"

namespace rugae {
namespace {

constexpr int kVignettingFrames = 16;  // spread over the sequence
constexpr int kProfileSamples = 257;   // of the published profile
constexpr std::size_t kCachedFrames = 6;
constexpr std::size_t kCachedGrays = 24;

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
  Cache<Frame> frames{kCachedFrames}, pose_frames{kCachedFrames}, map_frames{kCachedFrames};
  Cache<cv::Mat> grays{kCachedGrays};

  Impl(const Observations& source, const PreprocessOptions& chosen)
      : observations(source), options(chosen), lens(source.lens()) {
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
  cv::Mat gray_of(const cv::Mat& bgr) const {
    cv::Mat gray;
    cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
    return gray;
  }

  void estimate_gain() {
    std::vector<cv::Mat> images, usable;
    for (const int index : vignetting_frames(observations.size())) {
      const cv::Mat gray = gray_of(observations.image(index));
      images.push_back(move(gray));
      const cv::Mat reflection = move_mask(detect_reflections(gray, options.reflections, field));
      usable.push_back(valid & ~reflection);
    }
    const double reach_px = 0.5 * std::hypot(lens.width, lens.height);
    const VignettingProfile found =
        estimate_vignetting(images, usable, {lens.cx, lens.cy}, reach_px);
    gain = vignetting_gain(found, lens.width, lens.height);
    for (int k = 0; k < kProfileSamples; ++k)
      profile.push_back(found.at(reach_px * k / (kProfileSamples - 1.0)));
  }

  cv::Mat make_gray(int index) const {
    cv::Mat gray = gray_of(observations.image(index));
    if (options.reflections.suppress_for_pose)
      gray = suppress_reflections(gray, detect_reflections(gray, options.reflections, field),
                                  options.reflections);
    return correct(move(gray));
  }

  Frame make_frame(int index, bool for_pose, bool for_map) const {
    const cv::Mat bgr = observations.image(index);
    const cv::Mat gray = gray_of(bgr);
    const cv::Mat reflection = detect_reflections(gray, options.reflections, field);
    const ReflectionOptions& chosen = options.reflections;
    Frame frame{index, {}, {}, {}, valid};
    if (for_pose) {
      frame.gray = correct(
          move(chosen.suppress_for_pose ? suppress_reflections(gray, reflection, chosen) : gray));
      frame.reflection = move_mask(reflection);
    }
    if (for_map)
      frame.map_bgr = correct(
          move(chosen.suppress_for_map ? suppress_reflections(bgr, reflection, chosen) : bgr));
    return frame;
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
  check(index >= 0 && index < size(), "frame {} of {}: no such frame", index, size());
  return impl_->frames.get(index, [&] { return impl_->make_frame(index, true, true); });
}

Frame FrameSource::pose_frame(int index) const {
  check(index >= 0 && index < size(), "frame {} of {}: no such frame", index, size());
  return impl_->pose_frames.get(index, [&] { return impl_->make_frame(index, true, false); });
}

Frame FrameSource::map_frame(int index) const {
  check(index >= 0 && index < size(), "frame {} of {}: no such frame", index, size());
  return impl_->map_frames.get(index, [&] { return impl_->make_frame(index, false, true); });
}

cv::Mat FrameSource::gray(int index) const {
  check(index >= 0 && index < size(), "frame {} of {}: no such frame", index, size());
  return impl_->grays.get(index, [&] { return impl_->make_gray(index); });
}

}  // namespace rugae
