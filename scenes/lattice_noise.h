#pragma once
// Noise on the integer lattice: values are functions of (position, seed), in plain arithmetic.

#include <cstdint>

#include "core/types.h"

namespace rugae {

/// The finaliser of MurmurHash3 (Appleby 2011): every bit of the input changes every bit of the
/// output.
inline std::uint32_t mix_bits(std::uint32_t h) {
  h ^= h >> 16;
  h *= 0x85ebca6bu;
  h ^= h >> 13;
  h *= 0xc2b2ae35u;
  return h ^ (h >> 16);
}

inline std::uint32_t lattice_hash(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = mix_bits(seed ^ static_cast<std::uint32_t>(x) * 0x9e3779b1u);
  h = mix_bits(h ^ static_cast<std::uint32_t>(y) * 0x85ebca77u);
  return mix_bits(h ^ static_cast<std::uint32_t>(z) * 0xc2b2ae3du);
}

struct NoiseSample {
  double value = 0.0;  // about -1 to 1
  Vec3 gradient = Vec3::Zero();
};

/// Gradient noise with quintic fade and its exact derivative: Perlin, Improving noise, SIGGRAPH
/// 2002, doi:10.1145/566570.566636. With `period` > 0 the lattice repeats after so many cells.
NoiseSample gradient_noise(const Vec3& p, std::uint32_t seed, int period = 0);

/// Distances to the nearest and second nearest feature point (one a lattice cell), and the nearest
/// one's hash: Worley, A cellular texture basis function, SIGGRAPH 1996, doi:10.1145/237170.237267.
struct CellSample {
  double nearest = 0.0, second = 0.0;
  std::uint32_t id = 0;
};
CellSample cell_noise(const Vec3& p, std::uint32_t seed, int period = 0);

}  // namespace rugae
