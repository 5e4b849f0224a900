#include "render/isp.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/check.h"
#include "core/portable_math.h"

namespace rugae {
namespace {

constexpr double kMostWhiteBalance = 4.0;  // assumed: two stops

}  // namespace

int bayer_channel(Bayer pattern, int x, int y) {
  constexpr int kChannels[4][4] = {{0, 1, 1, 2}, {2, 1, 1, 0}, {1, 0, 2, 1}, {1, 2, 0, 1}};
  return kChannels[static_cast<int>(pattern) - 1][2 * (y & 1) + (x & 1)];
}

cv::Mat demosaic(const cv::Mat& mosaic, Bayer pattern) {
  check(mosaic.type() == CV_16U && mosaic.cols >= 4 && mosaic.rows >= 4,
        "demosaicing: an image of {} x {} of {}, expected at least 4 x 4 of 16UC1", mosaic.cols,
        mosaic.rows, cv::typeToString(mosaic.type()));
  int code = 0;
  switch (pattern) {
    case Bayer::none:
      fail("demosaicing: no Bayer pattern");
    case Bayer::rggb:
      code = cv::COLOR_BayerRGGB2BGR_EA;
      break;
    case Bayer::bggr:
      code = cv::COLOR_BayerBGGR2BGR_EA;
      break;
    case Bayer::grbg:
      code = cv::COLOR_BayerGRBG2BGR_EA;
      break;
    case Bayer::gbrg:
      code = cv::COLOR_BayerGBRG2BGR_EA;
      break;
  }
  cv::Mat bgr;
  cv::demosaicing(mosaic, bgr, code);
  return bgr;
}

double display_value(Tone tone, double linear) {
  linear = std::clamp(linear, 0.0, 1.0);
  switch (tone) {
    case Tone::srgb:
      return linear <= 0.0031308 ? 12.92 * linear
                                 : 1.055 * portable_power(linear, 1.0 / 2.4) - 0.055;
    case Tone::gamma22:
      return linear <= 0.0 ? 0.0 : portable_power(linear, 1.0 / 2.2);
    case Tone::linear:
      break;
  }
  return linear;
}

Vec3 grey_world_gains(const cv::Mat& radiance, double full_scale) {
  Vec3 sum = Vec3::Zero();
  for (int y = 0; y < radiance.rows; ++y) {
    const auto* row = radiance.ptr<Vec3f>(y);
    for (int x = 0; x < radiance.cols; ++x)
      for (int c = 0; c < 3; ++c) sum[c] += std::min<double>(full_scale, std::max(0.0f, row[x][c]));
  }
  const auto gain = [&](double of) {
    if (!(of > 0.0) || !(sum[1] > 0.0)) return 1.0;
    return std::clamp(sum[1] / of, 1.0 / kMostWhiteBalance, kMostWhiteBalance);
  };
  return {gain(sum[0]), 1.0, gain(sum[2])};
}

DisplayTable::DisplayTable(Tone tone, int black, int top, const Vec3& gains_rgb) {
  check(black >= 0 && black < top, "display: black is {}, expected 0 to {}", black, top - 1);
  for (int c = 0; c < 3; ++c) {
    auto& values = values_[static_cast<std::size_t>(c)];
    for (int number = 0; number <= top; ++number) {
      const double share = static_cast<double>(number - black) / (top - black);
      values.push_back(static_cast<unsigned char>(
          std::floor(255.0 * display_value(tone, gains_rgb[c] * share) + 0.5)));
    }
  }
}

}  // namespace rugae
