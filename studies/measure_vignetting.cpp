#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "dataset/observations.h"
#include "dataset/truth.h"
#include "recon/preprocess/devignette.h"
#include "recon/preprocess/preprocess.h"
#include "recon/preprocess/undistort.h"
#include "studies/light_alone.h"
#include "studies/measure.h"
#include "studies/measure_parts.h"

namespace rugae {
namespace {

using nlohmann::json;

constexpr int kRings = 32;  // of equal width, from the centre to half the diagonal
constexpr unsigned char kDarkest = 8, kBrightest = 250;  // what the estimate uses
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct Mean {
  double sum = 0.0, squares = 0.0;
  std::size_t count = 0;
  void add(double value) {
    sum += value;
    squares += value * value;
    ++count;
  }
  double value() const { return sum / static_cast<double>(count); }
  double rms_about_it() const {
    return std::sqrt(std::max(0.0, squares / static_cast<double>(count) - value() * value()));
  }
};
using Rings = std::vector<Mean>;

// ln V of the camera at the pixels of a picture taken through another lens, or through its own;
// CV_64F, NaN where `valid` is 0.
cv::Mat true_ln_v(const Camera& camera, bool vignetting, const Lens& lens, const cv::Mat& valid) {
  const LensProjector picture(lens), observed(camera.lens);
  cv::Mat ln_v(valid.size(), CV_64F, cv::Scalar(kNone));
  for (int y = 0; y < valid.rows; ++y)
    for (int x = 0; x < valid.cols; ++x) {
      if (!valid.at<unsigned char>(y, x)) continue;
      const auto ray = picture.unproject({x + 0.5, y + 0.5});
      const auto pixel = ray ? observed.project(*ray) : std::nullopt;
      if (!pixel) continue;
      const double v = vignetting ? vignette_at(camera.vignetting, camera.lens, *pixel, *ray) : 1.0;
      ln_v.at<double>(y, x) = std::log(v);
    }
  return ln_v;
}

class VignettingMeasure {
 public:
  VignettingMeasure(const std::filesystem::path& dataset, const VignettingMeasureOptions& options)
      : truth_(Truth::open(dataset)),
        observations_(Observations::open(dataset)),
        made_(dataset_settings(dataset)),
        tone_(made_.render.sensor.tone),
        plain_(observations_, uncorrected(options.preprocess)),
        lens_(plain_.lens()),
        center_px_(lens_.cx, lens_.cy),
        reach_px_(0.5 * std::hypot(lens_.width, lens_.height)),
        used_(vignetting_frames(observations_.size())) {
    check(observations_.size() == truth_.size(), "{}: {} frames and {} true poses",
          dataset.string(), observations_.size(), truth_.size());
    if (options.preprocess.undistort) undistortion_.emplace(truth_.camera().lens, lens_);
    estimated_ = {center_px_, reach_px_,
                  FrameSource(observations_, options.preprocess).vignetting_profile()};
    ln_v_ = true_ln_v(truth_.camera(), made_.render.lens.vignetting, lens_, plain_.valid());
  }

  int used() const { return static_cast<int>(used_.size()); }

  json measure(Progress& progress) const {
    const bool has_light = made_.labels.depth && made_.labels.normals;
    Rings exponents(kRings);
    std::vector<cv::Mat> lit, usable;
    for (const int index : used_) {
      const Frame frame = plain_.frame(index);
      add_exponents(frame, exponents);
      const cv::Mat picture = has_light ? lit_alone(index) : cv::Mat();
      if (!picture.empty()) {
        lit.push_back(picture);
        usable.push_back(frame.valid & ~frame.reflection);
      }
      progress.step();
    }
    fill_gaps(exponents);
    std::optional<VignettingProfile> light;
    if (!lit.empty()) light = estimate_vignetting(lit, usable, center_px_, reach_px_);
    return compare(exponents, light);
  }

 private:
  static PreprocessOptions uncorrected(PreprocessOptions options) {
    options.devignette = false;
    options.reflections.suppress_for_pose = options.reflections.suppress_for_map = false;
    return options;
  }

  double radius_px(int x, int y) const { return (Vec2(x + 0.5, y + 0.5) - center_px_).norm(); }
  std::size_t ring(double radius_px) const {
    return static_cast<std::size_t>(
        std::clamp(static_cast<int>(kRings * radius_px / reach_px_), 0, kRings - 1));
  }

  void add_exponents(const Frame& frame, Rings& rings) const {
    for (int y = 0; y < frame.gray.rows; ++y)
      for (int x = 0; x < frame.gray.cols; ++x) {
        const unsigned char value = frame.gray.at<unsigned char>(y, x);
        const double ln_v = ln_v_.at<double>(y, x);
        if (std::isfinite(ln_v) && !frame.reflection.at<unsigned char>(y, x) && value >= kDarkest &&
            value <= kBrightest)
          rings[ring(radius_px(x, y))].add(tone_.exponent(value / 255.0, ln_v));
      }
  }
  // A ring without samples takes those of the next one inside it that has some, or outside it.
  static void fill_gaps(Rings& rings) {
    const auto first = std::ranges::find_if(rings, [](const Mean& m) { return m.count > 0; });
    check(first != rings.end(), "vignetting: every pixel of the frames is dark or saturated");
    Mean last = *first;
    for (Mean& m : rings) {
      if (m.count == 0) m = last;
      last = m;
    }
  }

  // On the grid of the preprocessed picture.
  cv::Mat lit_alone(int index) const {
    const Camera& camera = truth_.camera();
    cv::Mat gray, through;
    cv::cvtColor(observations_.image(index), gray, cv::COLOR_BGR2GRAY);
    cv::exp(true_ln_v(camera, made_.render.lens.vignetting, camera.lens, plain_.field()), through);
    through.convertTo(through, CV_32F);
    gray.setTo(0, plain_.field() == 0);
    const cv::Mat picture = picture_of_light(
        light_alone(truth_.depth_mm(index), truth_.normal(index), camera.lens, camera.lights),
        through, gray, tone_);
    return picture.empty() || !undistortion_ ? picture : undistortion_->image(picture);
  }

  json compare(const Rings& exponents, const std::optional<VignettingProfile>& light) const {
    Mean before, after, after_light, exponent;
    Rings truth_of_ring(kRings), estimate_of_ring(kRings), light_of_ring(kRings);
    struct Corner {
      double radius_px = -1.0, ln_true = 0.0, ln_estimated = 0.0, ln_light = 0.0;
    } corner;
    for (int y = 0; y < ln_v_.rows; ++y)
      for (int x = 0; x < ln_v_.cols; ++x) {
        if (!std::isfinite(ln_v_.at<double>(y, x))) continue;
        const double radius = radius_px(x, y);
        const std::size_t k = ring(radius);
        const double e = exponents[k].value();
        const double ln_true = e * ln_v_.at<double>(y, x);
        const double ln_estimated = std::log(estimated_.at(radius));
        const double ln_light = light ? std::log(light->at(radius)) : 0.0;
        before.add(ln_true);
        after.add(ln_true - ln_estimated);
        after_light.add(ln_true + ln_light - ln_estimated);
        exponent.add(e);
        truth_of_ring[k].add(ln_true);
        estimate_of_ring[k].add(ln_estimated);
        light_of_ring[k].add(ln_light);
        if (radius > corner.radius_px) corner = {radius, ln_true, ln_estimated, ln_light};
      }
    check(before.count > 0, "vignetting: the preprocessed picture has no pixel that sees");
    const double left = after.rms_about_it(), left_by_light = after_light.rms_about_it();
    const std::size_t has_light = light ? 1 : 0;
    const double ln_error = corner.ln_estimated - corner.ln_true;
    return {
        {"frames", used()},
        {"rms_ln_before", before.rms_about_it()},
        {"rms_ln_after", left},
        {"rms_ln_after_light", known(left_by_light, has_light)},
        {"light_share",
         light && left > 0.0 ? json(1.0 - left_by_light * left_by_light / (left * left)) : json()},
        {"corner_true", std::exp(corner.ln_true)},
        {"corner_estimated", std::exp(corner.ln_estimated)},
        {"corner_light", known(std::exp(corner.ln_light), has_light)},
        {"corner_ln_error", ln_error},
        {"corner_ln_error_light", known(ln_error - corner.ln_light, has_light)},
        {"corner_radius_share", corner.radius_px / reach_px_},
        {"exponent_mean", exponent.value()},
        {"profile",
         {{"radius_share", radii()},
          {"true", plotted(truth_of_ring)},
          {"estimated", plotted(estimate_of_ring)},
          {"light", light ? plotted(light_of_ring) : json()}}}};
  }

  static json radii() {
    json list = json::array();
    for (int k = 0; k < kRings; ++k) list.push_back((k + 0.5) / kRings);
    return list;
  }
  static json plotted(const Rings& rings) {
    json list = json::array();
    for (const Mean& m : rings) list.push_back(known(std::exp(m.value()), m.count));
    return list;
  }

  Truth truth_;
  Observations observations_;
  DatasetSettings made_;
  ToneCurve tone_;
  FrameSource plain_;  // without de-vignetting
  Lens lens_;          // of the preprocessed pictures
  Vec2 center_px_;
  double reach_px_;
  std::vector<int> used_;
  std::optional<Undistortion> undistortion_;
  VignettingProfile estimated_;
  cv::Mat ln_v_;  // of the light, on the pictures' grid
};

}  // namespace

void VignettingMeasureOptions::check() const {
  preprocess.check();
  rugae::check(preprocess.devignette, "vignetting: preprocess.devignette is false, expected true");
}

json measure_vignetting(const std::filesystem::path& dataset,
                        const VignettingMeasureOptions& options, Progress& progress) {
  options.check();
  const VignettingMeasure measure(dataset, options);
  progress.begin("vignetting", static_cast<std::size_t>(measure.used()));
  const json result = measure.measure(progress);
  progress.end();
  return {{"vignetting", result}};
}

}  // namespace rugae
