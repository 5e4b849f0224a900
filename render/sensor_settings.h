#pragma once
// The switches between light and file: sensor, exposure, display, output.

namespace rugae {

/// Colours of the first two photosites of the first two rows.
enum class Bayer { none, rggb, bggr, grbg, gbrg };
enum class WhiteBalance { none, fixed, grey_world };
enum class Tone { srgb, gamma22, linear };
enum class ExposureMode {
  per_frame,  // each frame as its own brightness wants it
  fixed,      // the same for all
  automatic,  // follows earlier frames, with delay and smoothing (render/metering.h)
};

struct SensorSettings {
  bool noise = true;          // shot and read noise
  bool prnu = false;          // pixels of unequal gain, by the camera's share
  bool dsnu = false;          // pixels of unequal offset, by the camera's electrons
  Bayer bayer = Bayer::none;  // none: every pixel measures all three colours
  WhiteBalance white_balance = WhiteBalance::none;
  double red_gain = 1.0, blue_gain = 1.0;  // of the fixed white balance; green has 1
  Tone tone = Tone::srgb;

  ExposureMode exposure = ExposureMode::per_frame;
  double exposure_time_s = 0.01, gain = 2.0;  // of the fixed exposure
  int delay_frames = 2;                       // of the automatic one
  double smoothing = 0.5;  // of the automatic one: the share of the old exposure that stays
};

enum class FrameFormat { png, jpeg };

struct OutputSettings {
  FrameFormat frames = FrameFormat::png;
  int jpeg_quality = 90;
  bool adc = false;       // observations/adc: the converter's numbers, 16-bit PNG
  bool mosaic = false;    // observations/mosaic: one number a photosite, 16-bit PNG; needs a Bayer
                          // pattern
  bool radiance = false;  // truth/radiance: linear light, EXR
  bool paired = false;    // truth/clean: the same frame from a sensor without faults
};

}  // namespace rugae
