#pragma once
// How long and how strongly a frame is exposed: metering of the noise-free light, and a control
// that follows it.

#include <map>
#include <opencv2/core/mat.hpp>

#include "cameras/camera.h"
#include "render/isp.h"
#include "render/sensor_settings.h"

namespace rugae {

struct Exposure {
  double time_s = 0.0;
  double gain = 1.0;  // analogue, before the ADC: full scale is full well / gain
  bool operator==(const Exposure&) const = default;
};

/// What the sequence's exposure control must know of a frame.
struct FrameExposure {
  Exposure used;
  Exposure metered;  // what the frame's own brightness asks for
};

class Metering {
 public:
  explicit Metering(const Sensor& sensor);

  /// The exposure that suits a frame (CV_32FC3, RGB, without noise): the mean brightness, by the
  /// sRGB curve, of the pixels that see the wall comes to kTargetBrightness, less where more than
  /// kBrightShare of them would reach full scale.
  Exposure expose(const cv::Mat& radiance) const;
  /// Splits `total_s`, time times gain: a longer exposure comes first, up to half the frame's time,
  /// then gain up to kMostGain.
  Exposure split(double total_s) const;
  /// Mean electrons of a radiance (linear).
  double electrons(double radiance, const Exposure& exposure) const;

  // Measured on the twelve frames of the Kvasir-Capsule banner (Smedsrud et al. 2021,
  // doi:10.1038/s41597-021-00920-z): mean luminance 87 to 113 of 255, 104 on average; at most 2 %
  // of the pixels saturated in all but two.
  static constexpr double kTargetBrightness = 0.41;
  static constexpr double kBrightShare = 0.02;
  static constexpr double kMostGain = 16.0;  // assumed: 24 dB, usual for small CMOS sensors

 private:
  Sensor sensor_;
  double longest_s_, shortest_s_;
  int top_;  // of the ADC
  DisplayTable display_;
};

/// The exposures of a sequence, in the frames' order. Automatic: with m(t) the total exposure
/// (time times gain) that metering asks for in frame t, and e(t) the one that is used,
///
///   e(t) = e(t-1)^smoothing  m(t - delay)^(1 - smoothing)
///
/// as in a loop that works in stops. Before the first frame the capsule has long looked at the
/// first view: m(t) = m(0) for t < 0, and e(-1) = m(0).
class ExposureControl {
 public:
  /// Throws Error when the fixed exposure is longer than a frame lasts.
  ExposureControl(const Sensor& sensor, const SensorSettings& settings);

  /// The exposure of a frame. `known` holds earlier frames; automatic exposure needs the metering
  /// of frame max(0, t - delay) and the exposure of t - 1, and throws Error without them.
  Exposure next(int frame, const Exposure& metered,
                const std::map<int, FrameExposure>& known) const;
  /// True when the exposure of a frame depends on frames before it.
  bool has_memory() const { return settings_.exposure == ExposureMode::automatic; }

 private:
  Metering metering_;
  SensorSettings settings_;
};

}  // namespace rugae
