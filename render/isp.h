#pragma once
// From the converter's numbers to a picture: demosaicing, white balance, the display curve.

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/types.h"
#include "render/sensor_settings.h"

namespace rugae {

/// The colour (0 red, 1 green, 2 blue) of the photosite in column x of row y. Not for Bayer::none.
int bayer_channel(Bayer pattern, int x, int y);

/// CV_16UC3 in BGR from CV_16U, one number a photosite, by OpenCV's edge-aware interpolation: green
/// along the direction of the smaller difference, the other colours by the mean of the two or four
/// nearest, all in whole numbers. The outermost row and column repeat their inner neighbours.
cv::Mat demosaic(const cv::Mat& mosaic, Bayer pattern);

/// The display value of a linear one, both in [0, 1]: IEC 61966-2-1, v^(1/2.2), or v. To 1e-7, the
/// same bits on every machine.
double display_value(Tone tone, double linear);

/// Gains of red, green and blue that make the frame grey on average, green 1 (Buchsbaum 1980,
/// doi:10.1016/0016-0032(80)90058-7), from the noise-free light (CV_32FC3, RGB; `full_scale` is the
/// radiance of white); pixels without light do not count. Each within 1/4 and 4.
Vec3 grey_world_gains(const cv::Mat& radiance, double full_scale);

/// The 8-bit display value of a converter's number, a table a channel.
class DisplayTable {
 public:
  /// `black` and `top`: the numbers of no light and of full scale.
  DisplayTable(Tone tone, int black, int top, const Vec3& gains_rgb = Vec3::Ones());
  unsigned char operator()(int channel_rgb, int number) const {
    return values_[static_cast<std::size_t>(channel_rgb)][static_cast<std::size_t>(number)];
  }

 private:
  std::array<std::vector<unsigned char>, 3> values_;
};

}  // namespace rugae
