#include "render/electron_noise.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/random4.h"

namespace rugae {
namespace {

// w = z + g1 (z^2 - 1) / 6 + g2 (z^3 - 3 z) / 24 - g1^2 (2 z^3 - 5 z) / 36 with skewness
// g1 = m / s^3 and excess g2 = m / s^4; electrons = m + s w. For one number or four.
template <typename T>
T smooth(T mean_e, T read2, T z) {
  const T variance = mean_e + read2;
  const T s = root(variance), inverse = 1.0f / variance;
  const T excess = mean_e * inverse * inverse, skew = excess * s;
  const T z2 = z * z;
  const T w = z + skew * (z2 - 1.0f) * (1.0f / 6.0f) +
              z * (excess * (z2 - 3.0f) * (1.0f / 24.0f) -
                   skew * skew * (2.0f * z2 - 5.0f) * (1.0f / 36.0f));
  return mean_e + s * w;
}

}  // namespace

std::array<float, 3> ElectronNoise::operator()(const std::array<float, 3>& mean_e,
                                               std::uint32_t frame, std::uint64_t pixel) const {
  const auto words = random_words(seed_, Purpose::shot_noise, frame, pixel);
  const float least = *std::ranges::min_element(mean_e);
  std::array<float, 3> electrons;
  if (least + read2_ >= kSmoothVariance && read2_ >= 1.0f) {
    for (int c = 0; c < 3; ++c) electrons[c] = smooth(mean_e[c], read2_, normal_(words[c]));
    return electrons;
  }
  const auto fraction_words = random_words(seed_, Purpose::shot_noise, frame, pixel | (1ull << 40));
  const auto read_words = random_words(seed_, Purpose::read_noise, frame, pixel);
  for (int c = 0; c < 3; ++c) {
    const float mean = std::max(0.0f, mean_e[c]);
    float shot;
    if (mean < PoissonTable::kExactBelow) {
      shot = static_cast<float>(poisson_(mean, words[c], fraction_words[c]));
    } else {
      const float s = std::sqrt(mean), z = normal_(words[c]), z2 = z * z;
      shot = std::floor(mean + s * z + (z2 - 1.0f) * (1.0f / 6.0f) - (z2 * z - z) / (72.0f * s) +
                        0.5f);
    }
    electrons[c] = shot + read_e_ * normal_(read_words[c]);
  }
  return electrons;
}

Float4x3 ElectronNoise::operator()(const Float4x3& mean_e, std::uint32_t frame,
                                   std::uint64_t pixel) const {
  const Float4 least = min(min(mean_e.x, mean_e.y), mean_e.z);
  // false for NaN, as above
  const Float4 smooth_enough = _mm_cmpge_ps(least + splat(read2_), splat(kSmoothVariance));
  Float4x3 electrons;
  if (read2_ >= 1.0f) {
    const auto words = random_words_of_four(seed_, Purpose::shot_noise, frame, pixel);
    const Float4 read2 = splat(read2_);
    electrons = {smooth(mean_e.x, read2, normal_(words.word[0])),
                 smooth(mean_e.y, read2, normal_(words.word[1])),
                 smooth(mean_e.z, read2, normal_(words.word[2]))};
    if (all(smooth_enough)) return electrons;
  }
  const auto to_lanes = [](const Float4x3& v, float(&lanes)[3][4]) {
    _mm_store_ps(lanes[0], v.x);
    _mm_store_ps(lanes[1], v.y);
    _mm_store_ps(lanes[2], v.z);
  };
  alignas(16) float mean[3][4], out[3][4];
  to_lanes(mean_e, mean);
  for (int k = 0; k < 4; ++k) {
    const std::array<float, 3> of_pixel = {mean[0][k], mean[1][k], mean[2][k]};
    const auto e = (*this)(of_pixel, frame, pixel + static_cast<std::uint64_t>(k));
    for (int c = 0; c < 3; ++c) out[c][k] = e[c];
  }
  return {_mm_load_ps(out[0]), _mm_load_ps(out[1]), _mm_load_ps(out[2])};
}

}  // namespace rugae
