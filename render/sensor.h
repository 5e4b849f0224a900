#pragma once
// From light to bytes: exposure, electrons with their noise, the ADC, the display curve.

#include <array>
#include <atomic>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "cameras/camera.h"
#include "render/noise.h"

namespace rugae {

struct SensorOptions {
  bool noise = true;
  double read_noise_factor = 1.0;  // added sensor noise: the read noise times this
  std::uint64_t seed = 1;
};

struct Exposure {
  double time_s = 0.0;
  double gain = 1.0;  // analogue, before the ADC: full scale is full well / gain
};

/// Electrons of a pixel: Poisson of the mean, plus normal read noise.
///
/// Where the variance is at least kSmoothVariance and the read noise at least one electron, so that
/// single electrons cannot be told apart, both are drawn by one normal number z through the
/// expansion of Cornish and Fisher with the sum's exact first four cumulants (mean, mean + read^2,
/// mean, mean; Abramowitz and Stegun 26.2.49): the terms left out are below 1e-3 of a standard
/// deviation. Elsewhere the Poisson number is drawn by exact inversion (rounded Cornish-Fisher
/// above 64 electrons) and the read noise by a number of its own.
class ElectronNoise {
 public:
  ElectronNoise(double read_noise_e, std::uint64_t seed) : read_e_(read_noise_e), seed_(seed) {}
  /// Electrons of the three channels of a pixel with the given means.
  std::array<float, 3> operator()(const std::array<float, 3>& mean_e, std::uint32_t frame,
                                  std::uint64_t pixel) const;
  static constexpr double kSmoothVariance = 64.0;

 private:
  float smooth(float mean_e, float z) const;
  double read_e_;
  std::uint64_t seed_;
  NormalTable normal_;
  PoissonTable poisson_;
};

class SensorModel {
 public:
  SensorModel(const Sensor& sensor, const SensorOptions& options);

  /// Automatic exposure from the noise-free frame alone, without memory of other frames: the mean
  /// displayed brightness of the pixels that see the wall comes to kTargetBrightness, less where
  /// more than kBrightShare of them would reach full scale. A longer exposure comes first, up to
  /// half the frame's time, then gain up to kMostGain.
  Exposure expose(const cv::Mat& radiance) const;

  /// Mean electrons of a radiance (linear).
  double electrons(double radiance, const Exposure& exposure) const;
  /// The ADC's number for electrons, round half up, clipped to its range.
  int adc(float electrons, const Exposure& exposure) const;
  /// The 8-bit value of an ADC number by the sRGB curve (IEC 61966-2-1).
  unsigned char display(int adc) const { return display_[adc]; }
  int adc_top() const { return static_cast<int>(display_.size()) - 1; }

  /// CV_8UC3 in BGR; `radiance` is CV_32FC3 in RGB. Where a channel reaches the ADC's top,
  /// kMaskSaturated is set in `masks` (CV_8U). Noise is a function of (seed, frame, pixel). Adds
  /// the processor seconds of all threads to `time_s`.
  cv::Mat digitise(const cv::Mat& radiance, const Exposure& exposure, int frame, cv::Mat& masks,
                   std::atomic<double>* time_s = nullptr) const;

  // Measured on the twelve frames of the Kvasir-Capsule banner (Smedsrud et al. 2021,
  // doi:10.1038/s41597-021-00920-z): mean luminance 87 to 113 of 255, 104 on average; at most 2 %
  // of the pixels saturated in all but two.
  static constexpr double kTargetBrightness = 0.41;
  static constexpr double kBrightShare = 0.02;
  static constexpr double kMostGain = 16.0;  // assumed: 24 dB, usual for small CMOS sensors

 private:
  Sensor sensor_;
  SensorOptions options_;
  ElectronNoise noise_;
  std::vector<unsigned char> display_;
};

/// sRGB's encoding of a linear value in [0, 1].
double srgb_from_linear(double linear);

}  // namespace rugae
