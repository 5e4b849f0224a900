#pragma once
// From light to bytes: electrons with their noise and fixed patterns, the ADC, the picture.

#include <array>
#include <atomic>
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "cameras/camera.h"
#include "render/electron_noise.h"
#include "render/metering.h"

namespace rugae {

struct SensorOptions {
  SensorSettings chain = {};
  double read_noise_factor = 1.0;  // added sensor noise: the read noise times this
  std::uint64_t seed = 1;
  std::uint32_t camera = 0;  // cameras of one seed have noise and patterns of their own
  cv::Mat blanked = {};      // CV_8U, 255 where the camera makes its pixels black; may be empty
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
  void make_relative(cv::Mat& radiance, const Exposure& exposure) const;  // the same in place
  /// The ADC's number for electrons, round half up, clipped to its range.
  int adc(float electrons, const Exposure& exposure) const;
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
  __m128i adc(Float4 electrons, float numbers_per_electron) const;
  // Electrons of the four pixels from `pixel` on, a lane each.
  Float4x3 measure(const Float4x3& mean_e, int frame, std::uint64_t pixel) const;
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
