#include "render/sensor.h"

#include <gtest/gtest.h>

#include "core/check.h"
#include "core/types.h"
#include "core/units.h"
#include "dataset/layout.h"

namespace rugae {
namespace {

const Sensor kSensor{6.0, 30.0, 10, 18000.0, 10.0, Shutter::global};

cv::Mat gray(float radiance, int width = 64, int height = 48) {
  return cv::Mat(height, width, CV_32FC3, cv::Scalar::all(radiance));
}

cv::Mat no_masks(const cv::Mat& image) { return cv::Mat(image.size(), CV_8U, cv::Scalar(0)); }

// Radiance that gives this many electrons in the given exposure.
float radiance_for(const SensorModel& sensor, double electrons, const Exposure& exposure) {
  return static_cast<float>(electrons / sensor.electrons(1.0, exposure));
}

TEST(Sensor, AdcRoundsAndClips) {
  const SensorModel sensor(kSensor, {{.noise = false}});
  ASSERT_EQ(sensor.adc_top(), 1023);
  for (double gain : {1.0, 2.0, 7.3}) {
    const Exposure exposure{0.01, gain};
    const double step_e = 18000.0 / (1023.0 * gain);
    for (int number = 1; number < 1023; ++number) {
      ASSERT_EQ(sensor.adc(static_cast<float>((number - 0.49) * step_e), exposure), number);
      ASSERT_EQ(sensor.adc(static_cast<float>((number + 0.49) * step_e), exposure), number);
    }
    EXPECT_EQ(sensor.adc(-50.0f, exposure), 0);
    EXPECT_EQ(sensor.adc(static_cast<float>(18000.0 / gain), exposure), 1023);
    EXPECT_EQ(sensor.adc(1e9f, exposure), 1023);
    EXPECT_EQ(sensor.adc(std::numeric_limits<float>::quiet_NaN(), exposure), 0);
  }
}

// IEC 61966-2-1: the forward curve of the display value must give back the ADC's share to half a
// step of 8 bits.
TEST(Sensor, DisplayCurveIsSrgb) {
  const SensorModel sensor(kSensor, {});
  EXPECT_EQ(sensor.display(0), 0);
  EXPECT_EQ(sensor.display(1023), 255);
  for (int number = 0; number <= 1023; ++number) {
    const auto linear_of = [](double encoded) {
      return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
    };
    const double value = sensor.display(number), share = number / 1023.0;
    ASSERT_TRUE(linear_of((value - 0.5000001) / 255.0) <= share);
    ASSERT_TRUE(share <= linear_of((value + 0.5000001) / 255.0));
  }
}

TEST(Sensor, WithoutNoiseTheChainIsExact) {
  const SensorModel sensor(kSensor, {{.noise = false}});
  const Exposure exposure{0.004, 3.0};
  for (int number : {0, 5, 300, 801, 1022}) {
    const cv::Mat light =
        gray(radiance_for(sensor, number * 18000.0 / (1023.0 * 3.0), exposure), 8, 8);
    cv::Mat masks = no_masks(light);
    const cv::Mat image = sensor.digitise(light, exposure, 0, masks).bgr;
    for (int i = 0; i < 64; ++i) {
      ASSERT_EQ(image.ptr<cv::Vec3b>()[i], cv::Vec3b::all(sensor.display(number)));
      ASSERT_EQ(masks.ptr<unsigned char>()[i], 0);
    }
  }
}

TEST(Sensor, ColoursComeOutAsBlueGreenRed) {
  const SensorModel sensor(kSensor, {{.noise = false}});
  const Exposure exposure{0.01, 1.0};
  const float unit = radiance_for(sensor, 18000.0, exposure);
  const cv::Mat light(1, 1, CV_32FC3, cv::Scalar(0.8 * unit, 0.4 * unit, 0.1 * unit));
  cv::Mat masks = no_masks(light);
  const auto pixel = sensor.digitise(light, exposure, 0, masks).bgr.at<cv::Vec3b>(0, 0);
  EXPECT_GT(pixel[2], pixel[1]);
  EXPECT_GT(pixel[1], pixel[0]);
}

TEST(Sensor, SaturationIsMarkedWhereAChannelReachesTheTop) {
  const SensorModel sensor(kSensor, {{.noise = false}});
  const Exposure exposure{0.01, 2.0};
  cv::Mat light = gray(radiance_for(sensor, 4000.0, exposure), 4, 1);
  light.ptr<Vec3f>()[2][0] = radiance_for(sensor, 9500.0, exposure);
  cv::Mat masks = no_masks(light);
  masks.ptr<unsigned char>()[1] = kMaskValid;
  sensor.digitise(light, exposure, 0, masks);
  EXPECT_EQ(masks.ptr<unsigned char>()[0], 0);
  EXPECT_EQ(masks.ptr<unsigned char>()[1], kMaskValid);
  EXPECT_EQ(masks.ptr<unsigned char>()[2], kMaskSaturated);
}

// Mean and variance of the ADC's numbers over a grey frame: read off the 8-bit frame where one ADC
// step is at most one display step... the steps of the curve are known, so the expected moments are
// summed over the noise's distribution.
TEST(Sensor, FramesHaveTheModelsMeanAndVariance) {
  for (double factor : {1.0, 4.0})
    for (double electrons : {600.0, 5000.0}) {
      const SensorModel sensor(kSensor, {{}, factor, 21});
      const Exposure exposure{0.01, 2.0};
      const cv::Mat light = gray(radiance_for(sensor, electrons, exposure), 256, 192);
      cv::Mat masks = no_masks(light);
      const cv::Mat image = sensor.digitise(light, exposure, 5, masks).bgr;
      double sum = 0.0, squares = 0.0;
      const int n = 3 * 256 * 192;
      for (int i = 0; i < n; ++i) {
        const double v = image.data[i];
        sum += v;
        squares += v * v;
      }
      // By Simpson's rule over +-6 standard deviations of the electrons.
      const double sigma = std::sqrt(electrons + std::pow(10.0 * factor, 2));
      double weight = 0.0, mean = 0.0, square = 0.0;
      for (int i = 0; i <= 6000; ++i) {
        const double z = -6.0 + 12.0 * i / 6000;
        const double w = std::exp(-0.5 * z * z);
        const double v =
            sensor.display(sensor.adc(static_cast<float>(electrons + sigma * z), exposure));
        weight += w;
        mean += w * v;
        square += w * v * v;
      }
      mean /= weight;
      const double variance = square / weight - mean * mean;
      EXPECT_NEAR(sum / n, mean, 5.0 * std::sqrt(variance / n) + 2e-3 * std::sqrt(variance));
      EXPECT_NEAR((squares / n - std::pow(sum / n, 2)) / variance, 1.0,
                  5.0 * std::sqrt(2.0 / n) + 2e-3);
    }
}

TEST(Sensor, NoiseDependsOnSeedAndFrameOnly) {
  const SensorModel a(kSensor, {{}, 1.0, 1}), b(kSensor, {{}, 1.0, 2});
  const Exposure exposure{0.01, 2.0};
  const cv::Mat light = gray(radiance_for(a, 2000.0, exposure));
  cv::Mat masks = no_masks(light);
  const auto equal = [](const cv::Mat& p, const cv::Mat& q) {
    return std::equal(p.data, p.data + p.total() * 3, q.data);
  };
  const cv::Mat first = a.digitise(light, exposure, 3, masks).bgr;
  EXPECT_TRUE(equal(first, a.digitise(light, exposure, 3, masks).bgr));
  EXPECT_FALSE(equal(first, a.digitise(light, exposure, 4, masks).bgr));
  EXPECT_FALSE(equal(first, b.digitise(light, exposure, 3, masks).bgr));
}

// Exposure: brightness comes to its target whatever the light, as long as time and gain allow.
TEST(Sensor, ExposureFollowsTheLight) {
  const SensorModel sensor(kSensor, {{.noise = false}});
  double before = 0.0;
  for (float strength : {1e-4f, 3e-4f, 1e-3f, 1e-2f, 0.1f}) {
    cv::Mat light = gray(strength);
    for (int y = 0; y < light.rows; ++y)  // two octaves of brightness
      for (int x = 0; x < light.cols; ++x)
        light.ptr<Vec3f>(y)[x] *= static_cast<float>(std::exp2(2.0 * x / light.cols));
    const Exposure exposure = sensor.expose(light);
    EXPECT_GE(exposure.gain, 1.0);
    EXPECT_LE(exposure.gain, Metering::kMostGain);
    EXPECT_TRUE(exposure.time_s > 0.0 && exposure.time_s <= 0.5 / 30.0);
    if (exposure.gain > 1.0) {
      EXPECT_DOUBLE_EQ(exposure.time_s, 0.5 / 30.0);  // gain comes last
    }
    cv::Mat masks = no_masks(light);
    const cv::Mat image = sensor.digitise(light, exposure, 0, masks).bgr;
    double sum = 0.0;
    for (std::size_t i = 0; i < image.total() * 3; ++i) sum += image.data[i];
    EXPECT_NEAR(sum / (255.0 * 3.0 * image.total()), Metering::kTargetBrightness, 0.01);
    const double total = exposure.time_s * exposure.gain * strength;
    if (before > 0.0) {
      EXPECT_NEAR(total / before, 1.0, 0.01);
    }
    before = total;
  }
}

TEST(Sensor, ExposureSparesTheHighlights) {
  const SensorModel sensor(kSensor, {{.noise = false}});
  cv::Mat light = gray(1e-3f, 100, 100);
  for (int y = 0; y < 10; ++y)  // a tenth of the frame is up to forty times as bright
    for (int x = 0; x < 100; ++x) light.ptr<Vec3f>(y)[x] *= 0.04f * static_cast<float>(100 * y + x);
  const Exposure exposure = sensor.expose(light);
  cv::Mat masks = no_masks(light);
  sensor.digitise(light, exposure, 0, masks);
  int saturated = 0;
  for (int i = 0; i < 10000; ++i) saturated += masks.data[i] != 0;
  EXPECT_NEAR(saturated, Metering::kBrightShare * 10000, 20);
}

TEST(Sensor, DarknessTakesTheLongestExposure) {
  const SensorModel sensor(kSensor, {});
  const Exposure exposure = sensor.expose(gray(0.0f));
  EXPECT_EQ(exposure.gain, 1.0);
  EXPECT_DOUBLE_EQ(exposure.time_s, 0.5 / 30.0);
}

TEST(Sensor, RefusesASensorThatCannotBe) {
  Sensor broken = kSensor;
  broken.full_well_e = 0.0;
  EXPECT_THROW(SensorModel(broken, {}), Error);
  broken = kSensor;
  broken.bit_depth = 40;
  EXPECT_THROW(SensorModel(broken, {}), Error);
}

}  // namespace
}  // namespace rugae
