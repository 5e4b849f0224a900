#pragma once
// A picture that is known between the pixels: a sum of sines, so that a warped picture is exact.

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "core/random.h"
#include "core/types.h"

namespace rugae::testing {

class Texture {
 public:
  /// Waves with periods between the two, spread evenly over the logarithm of the period.
  explicit Texture(std::uint64_t seed, double shortest_px = 7.0, double longest_px = 90.0) {
    constexpr int kWaves = 60;
    for (int i = 0; i < kWaves; ++i) {
      const auto u = random_uniform(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
      const double period = shortest_px * std::pow(longest_px / shortest_px, u[0]);
      const double angle = kPi * u[1];
      waves_.push_back({2.0 * kPi / period * Vec2(std::cos(angle), std::sin(angle)),
                        2.0 * kPi * u[2], std::sqrt(period / longest_px)});
    }
    double power = 0.0;
    for (const Wave& w : waves_) power += 0.5 * w.amplitude * w.amplitude;
    for (Wave& w : waves_) w.amplitude *= kDeviation / std::sqrt(power);
  }

  /// About 0.5 +- 0.15.
  double operator()(const Vec2& p) const {
    double value = 0.5;
    for (const Wave& w : waves_) value += w.amplitude * std::sin(w.k.dot(p) + w.phase);
    return value;
  }

 private:
  static constexpr double kDeviation = 0.15;
  struct Wave {
    Vec2 k;
    double phase, amplitude;
  };
  std::vector<Wave> waves_;
};

/// CV_32F: value(p) at the pixel centres.
inline cv::Mat draw(int width, int height, const std::function<double(const Vec2&)>& value) {
  cv::Mat image(height, width, CV_32F);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.at<float>(y, x) = static_cast<float>(value({x + 0.5, y + 0.5}));
  return image;
}

/// CV_8U of [0, 1].
inline cv::Mat to_8bit(const cv::Mat& image) {
  cv::Mat out;
  image.convertTo(out, CV_8U, 255.0);
  return out;
}

}  // namespace rugae::testing
