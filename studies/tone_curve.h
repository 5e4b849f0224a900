#pragma once
// The sensor's display curve and its inverse, for values between 0 and 1 and beyond white.

#include <algorithm>
#include <cmath>

#include "render/sensor_settings.h"

namespace rugae {

/// The curves of render/isp.h. IEC 61966-2-1: s = 12.92 L below 0.0031308, and above
/// s = 1.055 L^(1/2.4) - 0.055.
class ToneCurve {
 public:
  explicit ToneCurve(Tone tone) : tone_(tone) {}

  double stored(double linear) const {
    if (tone_ == Tone::linear) return linear;
    if (tone_ == Tone::gamma22) return std::pow(linear, 1.0 / 2.2);
    return linear <= kToe ? kToeSlope * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
  }
  double linear(double stored) const {
    if (tone_ == Tone::linear) return stored;
    if (tone_ == Tone::gamma22) return std::pow(stored, 2.2);
    return stored <= kToeSlope * kToe ? stored / kToeSlope
                                      : std::pow((stored + 0.055) / 1.055, 2.4);
  }
  /// The exponent e with which light dimmed by V is stored: stored(L) = V^e stored(L / V). Where
  /// nothing is dimmed (ln V near 0), the slope of ln stored over ln L.
  double exponent(double stored_value, double ln_v) const {
    constexpr double kSmall = -1e-3;
    const double by = std::min(ln_v, kSmall);
    return std::log(stored_value / stored(linear(stored_value) * std::exp(-by))) / by;
  }

 private:
  static constexpr double kToe = 0.0031308, kToeSlope = 12.92;
  Tone tone_;
};

}  // namespace rugae
