#include "render/sensor.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/check.h"
#include "core/random.h"
#include "core/types.h"
#include "dataset/layout.h"
#include "render/radiance.h"
#include "render/thread_clock.h"

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

double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

// w = z + g1 (z^2 - 1) / 6 + g2 (z^3 - 3 z) / 24 - g1^2 (2 z^3 - 5 z) / 36 with skewness
// g1 = m / s^3 and excess g2 = m / s^4; electrons = m + s w.
float ElectronNoise::smooth(float mean_e, float z) const {
  const float variance = mean_e + static_cast<float>(read_e_ * read_e_);
  const float s = std::sqrt(variance), inverse = 1.0f / variance;
  const float excess = mean_e * inverse * inverse, skew = excess * s;
  const float z2 = z * z;
  const float w = z + skew * (z2 - 1.0f) * (1.0f / 6.0f) +
                  z * (excess * (z2 - 3.0f) * (1.0f / 24.0f) -
                       skew * skew * (2.0f * z2 - 5.0f) * (1.0f / 36.0f));
  return mean_e + s * w;
}

std::array<float, 3> ElectronNoise::operator()(const std::array<float, 3>& mean_e,
                                               std::uint32_t frame, std::uint64_t pixel) const {
  const auto words = random_words(seed_, Purpose::shot_noise, frame, pixel);
  const auto read2 = static_cast<float>(read_e_ * read_e_);
  const float least = *std::ranges::min_element(mean_e);
  std::array<float, 3> electrons;
  if (least + read2 >= static_cast<float>(kSmoothVariance) && read2 >= 1.0f) {
    for (int c = 0; c < 3; ++c) electrons[c] = smooth(mean_e[c], normal_(words[c]));
    return electrons;
  }
  const auto fraction_words = random_words(seed_, Purpose::shot_noise, frame, pixel | (1ull << 40));
  const auto read_words = random_words(seed_, Purpose::read_noise, frame, pixel);
  for (int c = 0; c < 3; ++c) {
    const float mean = std::max(0.0f, mean_e[c]);
    float shot;
    if (mean < PoissonTable::kExactBelow) {
      shot = static_cast<float>(poisson_(mean, words[c], fraction_words[c]));
    } else {
      const float s = std::sqrt(mean), z = normal_(words[c]), z2 = z * z;
      shot = std::floor(mean + s * z + (z2 - 1.0f) * (1.0f / 6.0f) - (z2 * z - z) / (72.0f * s) +
                        0.5f);
    }
    electrons[c] = shot + static_cast<float>(read_e_) * normal_(read_words[c]);
  }
  return electrons;
}

SensorModel::SensorModel(const Sensor& sensor, const SensorOptions& options)
    : sensor_(sensor),
      options_(options),
      noise_(sensor.read_noise_e * options.read_noise_factor, options.seed) {
  check(sensor.bit_depth >= 8 && sensor.bit_depth <= 16, "sensor: {} bits, expected 8 to 16",
        sensor.bit_depth);
  check(sensor.full_well_e > 0.0 && sensor.read_noise_e >= 0.0 && sensor.fps > 0.0,
        "sensor: full well {} e, read noise {} e, {} frames/s; expected above 0, at least 0, above "
        "0",
        sensor.full_well_e, sensor.read_noise_e, sensor.fps);
  display_.resize(static_cast<std::size_t>(1) << sensor.bit_depth);
  for (int dn = 0; dn <= adc_top(); ++dn)
    display_[dn] = static_cast<unsigned char>(
        std::floor(255.0 * srgb_from_linear(static_cast<double>(dn) / adc_top()) + 0.5));
}

// electrons = full_well (L / L_fill) (t / t_longest), L_fill = 1 / (pi d_fill^2)
double SensorModel::electrons(double radiance, const Exposure& exposure) const {
  const double fills = 1.0 / (kPi * kFillsWellAt_mm * kFillsWellAt_mm);
  const double longest_s = kLongestExposureOfFrame / sensor_.fps;
  return sensor_.full_well_e * (radiance / fills) * (exposure.time_s / longest_s);
}

int SensorModel::adc(float electrons, const Exposure& exposure) const {
  const auto scale = static_cast<float>(exposure.gain * adc_top() / sensor_.full_well_e);
  const float number = electrons * scale + 0.5f;
  if (!(number > 0.0f)) return 0;
  return number >= static_cast<float>(adc_top()) ? adc_top() : static_cast<int>(number);
}

Exposure SensorModel::expose(const cv::Mat& radiance) const {
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
  const double longest_s = kLongestExposureOfFrame / sensor_.fps,
               shortest_s = kShortestExposureOfFrame / sensor_.fps;
  if (lit == 0) return {longest_s, 1.0};

  // scale: full scale of the ADC a unit of radiance.
  const auto bins = brightness.filled();
  const auto mean_display = [&](double scale) {
    double sum = 0.0;
    for (const auto& bin : bins) {
      const double value = std::min(1.0, scale * 0.5 * (bin.low + bin.high));
      sum += bin.count * static_cast<double>(display_[static_cast<int>(value * adc_top() + 0.5)]);
    }
    return sum / (255.0 * lit);
  };
  const double at_gain_one = electrons(1.0, {longest_s, 1.0}) / sensor_.full_well_e;
  double low = at_gain_one * shortest_s / longest_s, high = at_gain_one * kMostGain;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (mean_display(middle) < kTargetBrightness ? low : high) = middle;
  }
  const double limit = 1.0 / upper_quantile(brightest.filled(), kBrightShare);
  const double scale = std::min(low, limit);

  Exposure exposure;
  exposure.time_s = std::clamp(longest_s * scale / at_gain_one, shortest_s, longest_s);
  exposure.gain = std::clamp(scale / (at_gain_one * exposure.time_s / longest_s), 1.0, kMostGain);
  return exposure;
}

cv::Mat SensorModel::digitise(const cv::Mat& radiance, const Exposure& exposure, int frame,
                              cv::Mat& masks, std::atomic<double>* time_s) const {
  check(masks.type() == CV_8U && masks.size() == radiance.size(),
        "sensor: the masks do not fit the frame");
  cv::Mat bgr(radiance.size(), CV_8UC3);
  const auto to_electrons = static_cast<float>(electrons(1.0, exposure));
  const int top = adc_top();
  tbb::parallel_for(tbb::blocked_range<int>(0, radiance.rows, 32), [&](const auto& rows) {
    const double start = thread_seconds();
    for (int y = rows.begin(); y < rows.end(); ++y) {
      const auto* in = radiance.ptr<Vec3f>(y);
      auto* out = bgr.ptr<cv::Vec3b>(y);
      auto* mask = masks.ptr<unsigned char>(y);
      for (int x = 0; x < radiance.cols; ++x) {
        std::array<float, 3> e = {in[x][0] * to_electrons, in[x][1] * to_electrons,
                                  in[x][2] * to_electrons};
        if (options_.noise)
          e = noise_(e, static_cast<std::uint32_t>(frame),
                     static_cast<std::uint64_t>(y) * radiance.cols + x);
        for (int c = 0; c < 3; ++c) {
          const int number = adc(e[c], exposure);
          out[x][2 - c] = display_[number];
          if (number == top) mask[x] |= kMaskSaturated;
        }
      }
    }
    if (time_s) *time_s += thread_seconds() - start;
  });
  return bgr;
}

}  // namespace rugae
