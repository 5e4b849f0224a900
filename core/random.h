#pragma once
// Randomness without state: a number is a function of where it is used, so no result depends on
// thread count or order. Philox4x32-10: Salmon et al., Parallel random numbers: as easy as 1, 2, 3,
// SC 2011, doi:10.1145/2063384.2063405.

#include <Random123/philox.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "core/units.h"

namespace rugae {

/// What a number is used for: two uses never share a number. Append only; the values are part of
/// the frames' bytes.
enum class Purpose : std::uint32_t {
  shot_noise = 1,
  read_noise = 2,
  fixed_pattern = 3,
  scene_relief = 4,
  scene_mucosa = 5,
  trajectory = 6,
  recon_ransac = 7,
  test = 8,
  oil = 9,
  light_path = 12,
  rig_camera = 13,
  scene_instances = 20,
  scene_draw = 21,
  lens_samples = 16,
  track_points = 17,
  wall_draws = 18,
};

/// Four independent 32-bit words for (seed, purpose, frame, index); index is the pixel or whatever
/// is counted.
inline std::array<std::uint32_t, 4> random_words(std::uint64_t seed, Purpose purpose,
                                                 std::uint32_t frame, std::uint64_t index) {
  using Generator = r123::Philox4x32;
  const Generator::ctr_type counter{{static_cast<std::uint32_t>(index),
                                     static_cast<std::uint32_t>(index >> 32), frame,
                                     static_cast<std::uint32_t>(purpose)}};
  const Generator::key_type key{
      {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  const Generator::ctr_type words = Generator()(counter, key);
  return {words[0], words[1], words[2], words[3]};
}

/// A word mapped to the open interval (0, 1): never 0, so its logarithm is finite.
inline double uniform01(std::uint32_t word) { return (word + 0.5) * 0x1p-32; }

/// Four independent uniform numbers in (0, 1).
inline std::array<double, 4> random_uniform(std::uint64_t seed, Purpose purpose,
                                            std::uint32_t frame, std::uint64_t index) {
  const auto w = random_words(seed, purpose, frame, index);
  return {uniform01(w[0]), uniform01(w[1]), uniform01(w[2]), uniform01(w[3])};
}

/// Four independent standard normal numbers, by the Box-Muller transform. For tests: the last bits
/// are those of the machine's mathematics library.
inline std::array<double, 4> random_normal(std::uint64_t seed, Purpose purpose, std::uint32_t frame,
                                           std::uint64_t index) {
  const auto u = random_uniform(seed, purpose, frame, index);
  const double r0 = std::sqrt(-2.0 * std::log(u[0])), r1 = std::sqrt(-2.0 * std::log(u[2]));
  const double a0 = 2.0 * kPi * u[1], a1 = 2.0 * kPi * u[3];
  return {r0 * std::cos(a0), r0 * std::sin(a0), r1 * std::cos(a1), r1 * std::sin(a1)};
}

}  // namespace rugae
