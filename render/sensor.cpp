#include "render/sensor.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/random.h"
#include "core/random4.h"
#include "core/types.h"
#include "dataset/layout.h"
#include "render/isp.h"
#include "render/thread_clock.h"

namespace rugae {
namespace {

// Of a random number's index: the pixel below bit 40, then what it is for, then the camera.
constexpr std::uint64_t kOffsetPattern = 1ull << 40;
constexpr int kCameraBits = 48;
constexpr int kFour = 4;  // pixels at once

// The last one again where there are fewer than four.
Float4x3 gathered(const Vec3f* light, int count) {
  const auto channel = [&](int c) {
    const auto of = [&](int k) { return light[std::min(k, count - 1)][c]; };
    return _mm_setr_ps(of(0), of(1), of(2), of(3));
  };
  return {channel(0), channel(1), channel(2)};
}

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
  cv::Mat share = radiance.clone();
  make_relative(share, exposure);
  return share;
}

void SensorModel::make_relative(cv::Mat& radiance, const Exposure& exposure) const {
  const double scale = exposure.gain * electrons(1.0, exposure) / sensor_.full_well_e;
  radiance.convertTo(radiance, CV_32F, scale);
}

float SensorModel::numbers_per_electron(const Exposure& exposure) const {
  return static_cast<float>(exposure.gain * (adc_top_ - sensor_.black_level) / sensor_.full_well_e);
}

int SensorModel::adc(float electrons, const Exposure& exposure) const {
  return _mm_cvtsi128_si32(adc(splat(electrons), numbers_per_electron(exposure)));
}

__m128i SensorModel::adc(Float4 electrons, float numbers_per_electron) const {
  const Float4 number = electrons * splat(numbers_per_electron) +
                        splat(static_cast<float>(sensor_.black_level)) + splat(0.5f);
  // the maximum with NaN is its second argument
  return _mm_cvttps_epi32(min(max(number, _mm_setzero_ps()), splat(static_cast<float>(adc_top_))));
}

// electrons = Poisson(mean (1 + prnu g)) + Normal(0, read noise) + dsnu h, g and h standard normal
// numbers of the photosite, the same in every frame.
Float4x3 SensorModel::measure(const Float4x3& mean_e, int frame, std::uint64_t pixel) const {
  const SensorSettings& chain = options_.chain;
  const auto pattern = [&](std::uint64_t first) {
    const auto words = random_words_of_four(options_.seed, Purpose::fixed_pattern, 0, first);
    return Float4x3{normal_(words.word[0]), normal_(words.word[1]), normal_(words.word[2])};
  };
  Float4x3 e = mean_e;
  if (chain.prnu) {
    const Float4 share = splat(static_cast<float>(sensor_.prnu));
    const auto gain = [share](Float4 g) { return max(splat(1.0f) + share * g, _mm_setzero_ps()); };
    const Float4x3 g = pattern(pixel);
    e = {e.x * gain(g.x), e.y * gain(g.y), e.z * gain(g.z)};
  }
  if (chain.noise) e = noise_(e, static_cast<std::uint32_t>(frame), pixel);
  if (chain.dsnu) e = e + pattern(pixel | kOffsetPattern) * static_cast<float>(sensor_.dsnu_e);
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
    alignas(16) std::array<std::array<std::int32_t, kFour>, 3> numbers;
    for (int x = 0; x < radiance.cols; x += kFour) {
      const int count = std::min(kFour, radiance.cols - x);
      const std::uint64_t pixel = first + static_cast<std::uint64_t>(y) * radiance.cols + x;
      const Float4x3 e = measure(gathered(in + x, count) * to_electrons, frame, pixel);
      const auto convert = [&](Float4 electrons, int c) {
        _mm_store_si128(reinterpret_cast<__m128i*>(numbers[c].data()), adc(electrons, to_numbers));
      };
      convert(e.x, 0);
      convert(e.y, 1);
      convert(e.z, 2);
      for (int k = 0; k < count; ++k) {
        if (bayer != Bayer::none) {
          const int number = numbers[bayer_channel(bayer, x + k, y)][k];
          images.mosaic.ptr<std::uint16_t>(y)[x + k] = static_cast<std::uint16_t>(number);
          if (number == adc_top_) mask[x + k] |= kMaskSaturated;
          continue;
        }
        auto& out = images.bgr.ptr<cv::Vec3b>(y)[x + k];
        for (int c = 0; c < 3; ++c) {
          out[2 - c] = table(c, numbers[c][k]);
          if (numbers[c][k] == adc_top_) mask[x + k] |= kMaskSaturated;
          if (keep_adc)
            images.adc_bgr.ptr<cv::Vec3w>(y)[x + k][2 - c] =
                static_cast<std::uint16_t>(numbers[c][k]);
        }
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
