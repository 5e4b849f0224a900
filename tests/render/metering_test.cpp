#include "render/metering.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/message_of.h"

namespace rugae {
namespace {

constexpr double kPortablePower = 1e-6;  // relative; exp and log of core/portable_math.h

const Sensor kSensor{6.0, 30.0, 10, 18000.0, 10.0};

double total(const Exposure& exposure) { return exposure.time_s * exposure.gain; }

// The exposures of a sequence whose frames ask for these totals.
std::vector<double> follow(const ExposureControl& control, const std::vector<double>& wanted_s) {
  const Metering metering(kSensor);
  std::map<int, FrameExposure> known;
  std::vector<double> used;
  for (int i = 0; i < static_cast<int>(wanted_s.size()); ++i) {
    const Exposure metered = metering.split(wanted_s[i]);
    known[i] = {control.next(i, metered, known), metered};
    used.push_back(total(known[i].used));
  }
  return used;
}

// A step from a to b at frame k: nothing until frame k + delay, and then the rest of the way in
// stops shrinks by `smoothing` a frame: e(k + delay + j) = b (a / b)^(smoothing^(j + 1)).
TEST(ExposureControl, AStepIsFollowedAfterTheDelay) {
  for (int delay : {0, 1, 3})
    for (double smoothing : {0.0, 0.5, 0.9})
      for (auto [a, b] : {std::pair(0.004, 0.08), std::pair(0.1, 0.002)}) {
        SCOPED_TRACE(testing::Message() << delay << " frames, " << smoothing << ", to " << b);
        SensorSettings settings;
        settings.exposure = ExposureMode::automatic;
        settings.delay_frames = delay;
        settings.smoothing = smoothing;
        constexpr int kStep = 6, kFrames = 30;
        std::vector<double> wanted(kFrames, b);
        std::fill_n(wanted.begin(), kStep, a);
        const std::vector<double> used = follow(ExposureControl(kSensor, settings), wanted);
        for (int i = 0; i < kFrames; ++i) {
          const int j = i - kStep - delay;
          const double expected = j < 0 ? a : b * std::pow(a / b, std::pow(smoothing, j + 1));
          EXPECT_TRUE(std::abs(used[i] / expected - 1.0) <= kPortablePower)
              << i << ": " << used[i] << " instead of " << expected;
        }
      }
}

TEST(ExposureControl, TimeComesBeforeGain) {
  const Metering metering(kSensor);
  const double longest_s = 0.5 / 30.0;
  EXPECT_EQ(metering.split(0.01), (Exposure{0.01, 1.0}));
  EXPECT_EQ(metering.split(3.0 * longest_s).time_s, longest_s);
  EXPECT_NEAR(metering.split(3.0 * longest_s).gain, 3.0, 1e-12);
  EXPECT_EQ(metering.split(100.0 * longest_s), (Exposure{longest_s, Metering::kMostGain}));
  EXPECT_GT(metering.split(0.0).time_s, 0.0);
}

TEST(ExposureControl, WithoutMemoryAFrameStandsAlone) {
  SensorSettings settings;
  const Exposure metered{0.003, 1.0};
  EXPECT_EQ(ExposureControl(kSensor, settings).next(9, metered, {}), metered);
  settings.exposure = ExposureMode::fixed;
  settings.exposure_time_s = 0.02;
  settings.gain = 5.0;
  EXPECT_EQ(ExposureControl(kSensor, settings).next(9, metered, {}), (Exposure{0.02, 5.0}));
  EXPECT_FALSE(ExposureControl(kSensor, settings).has_memory());
}

TEST(ExposureControl, SaysWhatIsWrong) {
  SensorSettings settings;
  settings.exposure = ExposureMode::fixed;
  settings.exposure_time_s = 0.05;
  EXPECT_EQ(message_of([&] { ExposureControl(kSensor, settings); }),
            "sensor: exposure_time_s is 0.05, expected at most 0.0333333 at 30 frames a second");
  settings.exposure = ExposureMode::automatic;
  EXPECT_EQ(message_of([&] {
              ExposureControl(kSensor, settings).next(5, {0.01, 1.0}, {});
            }),
            "automatic exposure of frame 5: frame 3 is not known");
}

}  // namespace
}  // namespace rugae
