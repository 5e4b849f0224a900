#include "render/sensor.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/random.h"
#include "core/types.h"
#include "dataset/layout.h"
#include "render/isp.h"
#include "render/thread_clock.h"

namespace rugae {
namespace {

// Of a random number's index: the pixel below bit 40, then what it is for, then the camera.
constexpr std::uint64_t kOffsetPattern = 1ull << 40;
constexpr int kCameraBits = 48;

const Sensor& checked(const Sensor& sensor) {
  check(sensor.bit_depth >= 8 && sensor.bit_depth <= 16, "sensor: {} bits, expected 8 to 16",
        sensor.bit_depth);
  check(sensor.full_well_e > 0.0 && sensor.read_noise_e >= 0.0 && sensor.fps > 0.0,
        "sensor: full well {} e, read noise {} e, {} frames/s; expected above 0, at least 0, above "
        "0",
        sensor.full_well_e, sensor.read_noise_e, sensor.fps);
  return sensor;
}

// Rows side by side; adds the threads' processor seconds to `time_s` unless that is null.
void for_rows(int rows, std::atomic<double>* time_s, const auto& one_row) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 32), [&](const auto& range) {
    const double start = thread_seconds();
    for (int y = range.begin(); y < range.end(); ++y) one_row(y);
    if (time_s) *time_s += thread_seconds() - start;
  });
}

}  // namespace

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
      noise_(sensor.read_noise_e * options.read_noise_factor, options.seed),
      metering_(checked(sensor)),
      adc_top_((1 << sensor.bit_depth) - 1),
      display_(options.chain.tone, sensor.black_level, adc_top_) {}

cv::Mat blanked_by_stop(const Lens& lens) {
  if (lens.stop.shape == StopShape::full) return {};
  cv::Mat blanked(lens.height, lens.width, CV_8U, cv::Scalar(0));
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x)
      if (!lens.passes_stop({x + 0.5, y + 0.5})) blanked.at<unsigned char>(y, x) = 255;
  return blanked;
}

SensorOptions faultless(SensorOptions options) {
  SensorSettings& chain = options.chain;
  chain.noise = chain.prnu = chain.dsnu = false;
  chain.bayer = Bayer::none;
  return options;
}

cv::Mat SensorModel::relative(const cv::Mat& radiance, const Exposure& exposure) const {
  cv::Mat share;
  radiance.convertTo(share, CV_32F, exposure.gain * electrons(1.0, exposure) / sensor_.full_well_e);
  return share;
}

float SensorModel::numbers_per_electron(const Exposure& exposure) const {
  return static_cast<float>(exposure.gain * (adc_top_ - sensor_.black_level) / sensor_.full_well_e);
}

int SensorModel::adc(float electrons, float numbers_per_electron) const {
  const float number =
      electrons * numbers_per_electron + static_cast<float>(sensor_.black_level) + 0.5f;
  if (!(number > 0.0f)) return 0;
  return number >= static_cast<float>(adc_top_) ? adc_top_ : static_cast<int>(number);
}

// electrons = Poisson(mean (1 + prnu g)) + Normal(0, read noise) + dsnu h, g and h standard normal
// numbers of the photosite, the same in every frame.
std::array<float, 3> SensorModel::measure(const Vec3f& light, float to_electrons, int frame,
                                          std::uint64_t pixel) const {
  std::array<float, 3> e = {light[0] * to_electrons, light[1] * to_electrons,
                            light[2] * to_electrons};
  const SensorSettings& chain = options_.chain;
  if (chain.prnu) {
    const auto words = random_words(options_.seed, Purpose::fixed_pattern, 0, pixel);
    const auto share = static_cast<float>(sensor_.prnu);
    for (int c = 0; c < 3; ++c) e[c] *= std::max(0.0f, 1.0f + share * normal_(words[c]));
  }
  if (chain.noise) e = noise_(e, static_cast<std::uint32_t>(frame), pixel);
  if (chain.dsnu) {
    const auto words =
        random_words(options_.seed, Purpose::fixed_pattern, 0, pixel | kOffsetPattern);
    const auto spread_e = static_cast<float>(sensor_.dsnu_e);
    for (int c = 0; c < 3; ++c) e[c] += spread_e * normal_(words[c]);
  }
  return e;
}

DisplayTable SensorModel::table_for(const cv::Mat& radiance, const Exposure& exposure) const {
  const SensorSettings& chain = options_.chain;
  if (chain.white_balance == WhiteBalance::none) return display_;
  const Vec3 gains =
      chain.white_balance == WhiteBalance::fixed
          ? Vec3(chain.red_gain, 1.0, chain.blue_gain)
          : grey_world_gains(radiance,
                             sensor_.full_well_e / (exposure.gain * electrons(1.0, exposure)));
  return {chain.tone, sensor_.black_level, adc_top_, gains};
}

void SensorModel::blank(SensorImages& images, cv::Mat& masks) const {
  if (options_.blanked.empty()) return;
  const auto black = cv::Scalar::all(sensor_.black_level);
  masks.setTo(0, options_.blanked);
  images.bgr.setTo(0, options_.blanked);
  if (!images.adc_bgr.empty()) images.adc_bgr.setTo(black, options_.blanked);
  if (!images.mosaic.empty()) images.mosaic.setTo(black, options_.blanked);
}

SensorImages SensorModel::digitise(const cv::Mat& radiance, const Exposure& exposure, int frame,
                                   cv::Mat& masks, bool keep_adc,
                                   std::atomic<double>* time_s) const {
  check(masks.type() == CV_8U && masks.size() == radiance.size(),
        "sensor: the masks do not fit the frame");
  const double begin = thread_seconds();
  const Bayer bayer = options_.chain.bayer;
  const DisplayTable table = table_for(radiance, exposure);
  if (time_s) *time_s += thread_seconds() - begin;
  SensorImages images;
  images.bgr.create(radiance.size(), CV_8UC3);
  if (bayer != Bayer::none) images.mosaic.create(radiance.size(), CV_16U);
  if (keep_adc && bayer == Bayer::none) images.adc_bgr.create(radiance.size(), CV_16UC3);
  const auto to_electrons = static_cast<float>(electrons(1.0, exposure));
  const float to_numbers = numbers_per_electron(exposure);

  const std::uint64_t first = static_cast<std::uint64_t>(options_.camera) << kCameraBits;
  const auto expose_row = [&](int y) {
    const auto* in = radiance.ptr<Vec3f>(y);
    auto* mask = masks.ptr<unsigned char>(y);
    for (int x = 0; x < radiance.cols; ++x) {
      const auto e = measure(in[x], to_electrons, frame,
                             first + static_cast<std::uint64_t>(y) * radiance.cols + x);
      if (bayer != Bayer::none) {
        const int number = adc(e[bayer_channel(bayer, x, y)], to_numbers);
        images.mosaic.ptr<std::uint16_t>(y)[x] = static_cast<std::uint16_t>(number);
        if (number == adc_top_) mask[x] |= kMaskSaturated;
        continue;
      }
      auto& out = images.bgr.ptr<cv::Vec3b>(y)[x];
      for (int c = 0; c < 3; ++c) {
        const int number = adc(e[c], to_numbers);
        out[2 - c] = table(c, number);
        if (number == adc_top_) mask[x] |= kMaskSaturated;
        if (keep_adc)
          images.adc_bgr.ptr<cv::Vec3w>(y)[x][2 - c] = static_cast<std::uint16_t>(number);
      }
    }
  };
  for_rows(radiance.rows, time_s, expose_row);
  if (bayer == Bayer::none) {
    blank(images, masks);
    return images;
  }

  const double start = thread_seconds();
  const cv::Mat numbers = demosaic(images.mosaic, bayer);
  if (time_s) *time_s += thread_seconds() - start;
  for_rows(radiance.rows, time_s, [&](int y) {
    const auto* in = numbers.ptr<cv::Vec3w>(y);
    auto* out = images.bgr.ptr<cv::Vec3b>(y);
    for (int x = 0; x < numbers.cols; ++x)
      for (int c = 0; c < 3; ++c) out[x][2 - c] = table(c, in[x][2 - c]);
  });
  if (keep_adc) images.adc_bgr = numbers;
  blank(images, masks);
  return images;
}

}  // namespace rugae
