#include "render/metering.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/check.h"
#include "core/portable_math.h"
#include "core/types.h"
#include "core/units.h"
#include "render/isp.h"
#include "render/radiance.h"

namespace rugae {
namespace {

// The light's strength, against which the sensitivity is stated: a white wall at this distance,
// facing an emitter of unit intensity, fills the well within the longest exposure. Assumed: so
// lit, mucosa at 20 to 50 mm is well exposed at gains of 1 to 6.
constexpr double kFillsWellAt_mm = 25.0;
constexpr double kLongestExposureOfFrame = 0.5;  // assumed: the other half reads out
constexpr double kShortestExposureOfFrame = 1e-4;

// A histogram over the logarithm: the upper bits of a positive float are its binary exponent and
// the first bits of its mantissa.
class LogHistogram {
 public:
  LogHistogram() : counts_(1u << (31 - kDropped), 0) {}
  void add(float value) { ++counts_[std::bit_cast<std::uint32_t>(value) >> kDropped]; }

  struct Bin {
    float low, high;
    int count;
  };
  std::vector<Bin> filled() const {
    std::vector<Bin> bins;
    for (std::uint32_t i = 0; i < counts_.size(); ++i)
      if (counts_[i] > 0)
        bins.push_back({std::bit_cast<float>(i << kDropped),
                        std::bit_cast<float>((i + 1) << kDropped), counts_[i]});
    return bins;
  }

 private:
  static constexpr int kDropped = 17;  // leaves 64 bins an octave
  std::vector<int> counts_;
};

// The value that `share` of the counts exceed, linear within a bin.
double upper_quantile(const std::vector<LogHistogram::Bin>& bins, double share) {
  double total = 0.0;
  for (const auto& bin : bins) total += bin.count;
  double above = share * total;
  for (auto bin = bins.rbegin(); bin != bins.rend(); ++bin) {
    if (above <= bin->count) return bin->high - (bin->high - bin->low) * (above / bin->count);
    above -= bin->count;
  }
  return bins.front().low;
}

}  // namespace

Metering::Metering(const Sensor& sensor)
    : sensor_(sensor),
      longest_s_(kLongestExposureOfFrame / sensor.fps),
      shortest_s_(kShortestExposureOfFrame / sensor.fps),
      top_((1 << sensor.bit_depth) - 1),
      display_(Tone::srgb, 0, top_) {}

// electrons = full_well (L / L_fill) (t / t_longest), L_fill = 1 / (pi d_fill^2)
double Metering::electrons(double radiance, const Exposure& exposure) const {
  const double fills = 1.0 / (kPi * kFillsWellAt_mm * kFillsWellAt_mm);
  return sensor_.full_well_e * (radiance / fills) * (exposure.time_s / longest_s_);
}

Exposure Metering::split(double total_s) const {
  Exposure exposure;
  exposure.time_s = std::clamp(total_s, shortest_s_, longest_s_);
  exposure.gain = std::clamp(total_s / exposure.time_s, 1.0, kMostGain);
  return exposure;
}

Exposure Metering::expose(const cv::Mat& radiance) const {
  LogHistogram brightness, brightest;
  int lit = 0;
  for (int y = 0; y < radiance.rows; ++y) {
    const auto* row = radiance.ptr<Vec3f>(y);
    for (int x = 0; x < radiance.cols; ++x) {
      const float l = luminance(row[x][0], row[x][1], row[x][2]);
      if (!(l > 0.0f)) continue;
      brightness.add(l);
      brightest.add(row[x].maxCoeff());
      ++lit;
    }
  }
  if (lit == 0) return {longest_s_, 1.0};

  // scale: full scale of the ADC a unit of radiance.
  const auto bins = brightness.filled();
  const auto mean_display = [&](double scale) {
    double sum = 0.0;
    for (const auto& bin : bins) {
      const double value = std::min(1.0, scale * 0.5 * (bin.low + bin.high));
      sum += bin.count * static_cast<double>(display_(1, static_cast<int>(value * top_ + 0.5)));
    }
    return sum / (255.0 * lit);
  };
  const double at_gain_one = electrons(1.0, {longest_s_, 1.0}) / sensor_.full_well_e;
  double low = at_gain_one * shortest_s_ / longest_s_, high = at_gain_one * kMostGain;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (mean_display(middle) < kTargetBrightness ? low : high) = middle;
  }
  const double limit = 1.0 / upper_quantile(brightest.filled(), kBrightShare);
  const double scale = std::min(low, limit);

  Exposure exposure;
  exposure.time_s = std::clamp(longest_s_ * scale / at_gain_one, shortest_s_, longest_s_);
  exposure.gain = std::clamp(scale / (at_gain_one * exposure.time_s / longest_s_), 1.0, kMostGain);
  return exposure;
}

ExposureControl::ExposureControl(const Sensor& sensor, const SensorSettings& settings)
    : metering_(sensor), settings_(settings) {
  check(settings.exposure != ExposureMode::fixed || settings.exposure_time_s * sensor.fps <= 1.0,
        "sensor: exposure_time_s is {}, expected at most {:.6g} at {} frames a second",
        settings.exposure_time_s, 1.0 / sensor.fps, sensor.fps);
}

Exposure ExposureControl::next(int frame, const Exposure& metered,
                               const std::map<int, FrameExposure>& known) const {
  if (settings_.exposure == ExposureMode::fixed) return {settings_.exposure_time_s, settings_.gain};
  if (settings_.exposure == ExposureMode::per_frame) return metered;
  const auto earlier = [&](int index) {
    const auto at = known.find(index);
    check(at != known.end(), "automatic exposure of frame {}: frame {} is not known", frame, index);
    return at->second;
  };
  const auto total = [](const Exposure& exposure) { return exposure.time_s * exposure.gain; };
  const int seen = std::max(0, frame - settings_.delay_frames);
  const double wanted_s = total(seen == frame ? metered : earlier(seen).metered);
  const double before_s = frame == 0 ? wanted_s : total(earlier(frame - 1).used);
  // (wanted / before)^(1 - smoothing), from the quotient that is at most 1
  const double quotient = std::min(wanted_s, before_s) / std::max(wanted_s, before_s);
  const double step = portable_power(quotient, 1.0 - settings_.smoothing);
  return metering_.split(wanted_s < before_s ? before_s * step : before_s / step);
}

}  // namespace rugae
