#pragma once
// The noise of a pixel's electrons.

#include <array>
#include <cstdint>

#include "core/float4.h"
#include "render/noise.h"

namespace rugae {

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
  ElectronNoise(double read_noise_e, std::uint64_t seed)
      : read_e_(static_cast<float>(read_noise_e)),
        read2_(static_cast<float>(read_noise_e * read_noise_e)),
        seed_(seed) {}
  /// Electrons of the three channels of a pixel with the given means.
  std::array<float, 3> operator()(const std::array<float, 3>& mean_e, std::uint32_t frame,
                                  std::uint64_t pixel) const;
  /// The same numbers for the four pixels from `pixel` on, a lane each.
  Float4x3 operator()(const Float4x3& mean_e, std::uint32_t frame, std::uint64_t pixel) const;
  static constexpr float kSmoothVariance = 64.0f;

 private:
  float read_e_, read2_;
  std::uint64_t seed_;
  NormalTable normal_;
  PoissonTable poisson_;
};

}  // namespace rugae
