// The sensor measured as a laboratory measures one (EMVA 1288, release 3.1, sections 2 and 6): what
// was configured must come out of the pictures.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/types.h"
#include "render/sensor.h"

namespace rugae {
namespace {

// The statistics below leave at most a third of this.
constexpr double kRecovered = 0.02;

constexpr int kWidth = 128, kHeight = 96;
constexpr int kSamples = 3 * kWidth * kHeight;
constexpr double kQuantisation = 1.0 / 12.0;  // variance of rounding, in numbers squared

Sensor sensor_in_the_laboratory() {
  Sensor sensor{6.0, 30.0, 10, 18000.0, 12.0};
  sensor.prnu = 0.015;
  sensor.dsnu_e = 15.0;
  sensor.black_level = 100;
  return sensor;
}

// A stack of pictures of one flat field: the mean over time of each photosite, and the variance
// over time, averaged over the photosites.
struct Stack {
  std::vector<double> means;
  double mean = 0.0, variance_in_time = 0.0, variance_in_space = 0.0;
};

Stack stack(const SensorModel& sensor, double electrons, double gain, int pictures) {
  const Exposure exposure{0.01, gain};
  const auto radiance = static_cast<float>(electrons / sensor.electrons(1.0, exposure));
  const cv::Mat light(kHeight, kWidth, CV_32FC3, cv::Scalar::all(radiance));
  cv::Mat masks(light.size(), CV_8U, cv::Scalar(0));
  std::vector<double> sum(kSamples, 0.0), squares(kSamples, 0.0);
  for (int picture = 0; picture < pictures; ++picture) {
    const cv::Mat adc = sensor.digitise(light, exposure, picture, masks, true).adc_bgr;
    const auto* number = adc.ptr<std::uint16_t>();
    for (int i = 0; i < kSamples; ++i) {
      sum[i] += number[i];
      squares[i] += static_cast<double>(number[i]) * number[i];
    }
  }
  Stack stack;
  double mean_squares = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    const double mean = sum[i] / pictures;
    stack.means.push_back(mean);
    stack.mean += mean / kSamples;
    mean_squares += mean * mean / kSamples;
    stack.variance_in_time += (squares[i] - pictures * mean * mean) / (pictures - 1) / kSamples;
  }
  stack.variance_in_space =
      mean_squares - stack.mean * stack.mean - stack.variance_in_time / pictures;
  return stack;
}

// variance = K mean + K^2 read^2 + 1/12 in numbers, K = gain (top - black) / full well.
TEST(PhotonTransfer, RecoversFullWellAndReadNoise) {
  const Sensor sensor = sensor_in_the_laboratory();
  for (double gain : {1.0, 4.0}) {
    const SensorModel model(sensor, {{.prnu = true, .dsnu = true}, 1.0, 5});
    constexpr int kPictures = 16;
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (double share : {0.1, 0.25, 0.4, 0.55, 0.7}) {
      const Stack at = stack(model, share * sensor.full_well_e / gain, gain, kPictures);
      const double x = at.mean - sensor.black_level, y = at.variance_in_time - kQuantisation;
      n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    const double full_well = gain * (model.adc_top() - sensor.black_level) / slope;
    EXPECT_TRUE(std::abs(full_well / sensor.full_well_e - 1.0) <= kRecovered) << full_well;
    const Stack dark = stack(model, 0.0, gain, kPictures);
    const double read_e = std::sqrt(dark.variance_in_time - kQuantisation) / slope;
    EXPECT_TRUE(std::abs(read_e / sensor.read_noise_e - 1.0) <= kRecovered) << read_e;
  }
}

// In space the gains spread by prnu times the mean: sqrt(s^2(mean) - s^2(dark)) / mean.
TEST(PhotonTransfer, RecoversPrnuFromFlatsAndDsnuFromDarks) {
  const Sensor sensor = sensor_in_the_laboratory();
  const SensorModel model(sensor, {{.prnu = true, .dsnu = true}, 1.0, 5});
  constexpr int kPictures = 24;
  constexpr double kGain = 2.0;
  const double k = kGain * (model.adc_top() - sensor.black_level) / sensor.full_well_e;
  const Stack dark = stack(model, 0.0, kGain, kPictures),
              flat = stack(model, 0.3 * sensor.full_well_e, kGain, kPictures);
  // the mean of many rounded numbers is not rounded: noise spreads over more than a number
  const double dsnu_e = std::sqrt(dark.variance_in_space) / k;
  EXPECT_TRUE(std::abs(dsnu_e / sensor.dsnu_e - 1.0) <= kRecovered) << dsnu_e;
  const double prnu =
      std::sqrt(flat.variance_in_space - dark.variance_in_space) / (flat.mean - dark.mean);
  EXPECT_TRUE(std::abs(prnu / sensor.prnu - 1.0) <= kRecovered) << prnu;
}

// The correlation of the photosites' means: of two sets of pictures of one camera, and of two
// cameras of one seed.
TEST(PhotonTransfer, FixedPatternsAreThoseOfTheCamera) {
  const Sensor sensor = sensor_in_the_laboratory();
  const auto correlation = [](const Stack& a, const Stack& b) {
    double sum = 0.0;
    for (int i = 0; i < kSamples; ++i) sum += (a.means[i] - a.mean) * (b.means[i] - b.mean);
    return sum / kSamples / std::sqrt(a.variance_in_space * b.variance_in_space);
  };
  constexpr int kPictures = 8;
  constexpr double kUncorrelated = 5.0 / 192.0;  // five standard deviations, 1 / sqrt(kSamples)
  const SensorModel model(sensor, {{.prnu = true, .dsnu = true}, 1.0, 5, 1}),
      sister(sensor, {{.prnu = true, .dsnu = true}, 1.0, 5, 2}),
      other_seed(sensor, {{.prnu = true, .dsnu = true}, 1.0, 6, 1});
  const Stack dim = stack(model, 2000.0, 1.0, kPictures), bright = stack(model, 9000.0, 1.0, 8);
  EXPECT_TRUE(correlation(dim, bright) >= 0.8) << correlation(dim, bright);
  EXPECT_TRUE(std::abs(correlation(bright, stack(sister, 9000.0, 1.0, 8))) <= kUncorrelated);
  EXPECT_TRUE(std::abs(correlation(bright, stack(other_seed, 9000.0, 1.0, 8))) <= kUncorrelated);
  // gains and offsets are two patterns, not one
  SensorModel gains(sensor, {{.noise = false, .prnu = true}, 1.0, 5, 1}),
      offsets(sensor, {{.noise = false, .dsnu = true}, 1.0, 5, 1});
  EXPECT_TRUE(std::abs(correlation(stack(gains, 9000.0, 1.0, 2), stack(offsets, 9000.0, 1.0, 2))) <=
              kUncorrelated);
}

// A Bayer sensor measures at each photosite what a sensor of three colours measures there.
TEST(PhotonTransfer, AMosaicHoldsTheNumbersOfItsPhotosites) {
  const Sensor sensor = sensor_in_the_laboratory();
  const Exposure exposure{0.01, 2.0};
  const SensorModel three(sensor, {{.prnu = true, .dsnu = true}, 1.0, 5}),
      one(sensor, {{.prnu = true, .dsnu = true, .bayer = Bayer::grbg}, 1.0, 5});
  const auto unit = static_cast<float>(3000.0 / three.electrons(1.0, exposure));
  const cv::Mat light(40, 60, CV_32FC3, cv::Scalar(2.0 * unit, unit, 0.5 * unit));
  cv::Mat masks(light.size(), CV_8U, cv::Scalar(0));
  const SensorImages full = three.digitise(light, exposure, 4, masks, true),
                     mosaic = one.digitise(light, exposure, 4, masks, true);
  ASSERT_EQ(mosaic.mosaic.type(), CV_16U);
  EXPECT_TRUE(full.mosaic.empty());
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x)
      ASSERT_EQ(mosaic.mosaic.at<std::uint16_t>(y, x),
                full.adc_bgr.at<cv::Vec3w>(y, x)[2 - bayer_channel(Bayer::grbg, x, y)]);
  // the picture is that of the demosaiced numbers
  const cv::Mat numbers = demosaic(mosaic.mosaic, Bayer::grbg);
  EXPECT_TRUE(std::equal(numbers.datastart, numbers.dataend, mosaic.adc_bgr.datastart));
  const DisplayTable table(Tone::srgb, sensor.black_level, one.adc_top());
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(mosaic.bgr.at<cv::Vec3b>(y, x)[c], table(2 - c, numbers.at<cv::Vec3w>(y, x)[c]));
}

}  // namespace
}  // namespace rugae
