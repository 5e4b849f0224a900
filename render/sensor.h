#pragma once
// From light to bytes: electrons with their noise and fixed patterns, the ADC, the picture.

#include <array>
#include <atomic>
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "cameras/camera.h"
#include "render/metering.h"
#include "render/noise.h"

namespace rugae {

struct SensorOptions {
  SensorSettings chain = {};
  double read_noise_factor = 1.0;  // added sensor noise: the read noise times this
  std::uint64_t seed = 1;
  std::uint32_t camera = 0;  // cameras of one seed have noise and patterns of their own
  cv::Mat blanked = {};      // CV_8U, 255 where the camera makes its pixels black; may be empty
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

/// The pixels whose centres the field stop covers, for SensorOptions; empty when it covers none.
cv::Mat blanked_by_stop(const Lens& lens);

/// The same chain without its faults: no noise, no fixed patterns, no mosaic.
SensorOptions faultless(SensorOptions options);

/// What a frame becomes; empty what is not made.
struct SensorImages {
  cv::Mat bgr;      // CV_8UC3, BGR: the frame as displayed
  cv::Mat adc_bgr;  // CV_16UC3, BGR: the converter's numbers, after demosaicing
  cv::Mat mosaic;   // CV_16U: the converter's numbers of a Bayer sensor, one a photosite
};

class SensorModel {
 public:
  SensorModel(const Sensor& sensor, const SensorOptions& options);

  /// See Metering.
  Exposure expose(const cv::Mat& radiance) const { return metering_.expose(radiance); }
  double electrons(double radiance, const Exposure& exposure) const {
    return metering_.electrons(radiance, exposure);
  }
  /// CV_32FC3, RGB: the light in units of the ADC's full scale, not clipped.
  cv::Mat relative(const cv::Mat& radiance, const Exposure& exposure) const;
  /// The ADC's number for electrons, round half up, clipped to its range.
  int adc(float electrons, const Exposure& exposure) const {
    return adc(electrons, numbers_per_electron(exposure));
  }
  /// The 8-bit value of an ADC number (without white balance).
  unsigned char display(int adc) const { return display_(1, adc); }
  int adc_top() const { return adc_top_; }

  /// `radiance` is CV_32FC3 in RGB. Where a channel reaches the ADC's top (of a Bayer sensor: the
  /// photosite), kMaskSaturated is set in `masks` (CV_8U). Noise is a function of (seed, camera,
  /// frame, pixel), the fixed patterns of (seed, camera, pixel). `keep_adc` asks for adc_bgr. Adds
  /// the processor seconds of all threads to `time_s`.
  SensorImages digitise(const cv::Mat& radiance, const Exposure& exposure, int frame,
                        cv::Mat& masks, bool keep_adc = false,
                        std::atomic<double>* time_s = nullptr) const;

 private:
  float numbers_per_electron(const Exposure& exposure) const;
  int adc(float electrons, float numbers_per_electron) const;
  std::array<float, 3> measure(const Vec3f& light, float to_electrons, int frame,
                               std::uint64_t pixel) const;
  void blank(SensorImages& images, cv::Mat& masks) const;
  DisplayTable table_for(const cv::Mat& radiance, const Exposure& exposure) const;

  Sensor sensor_;
  SensorOptions options_;
  ElectronNoise noise_;
  NormalTable normal_;
  Metering metering_;
  int adc_top_;
  DisplayTable display_;
};

}  // namespace rugae
