#pragma once
// The curve of displayed brightness, IEC 61966-2-1; both sides from 0 to 1.

#include <cmath>

namespace rugae {

inline double linear_from_srgb(double s) {
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}
inline double srgb_from_linear(double l) {
  return l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1.0 / 2.4) - 0.055;
}

}  // namespace rugae
